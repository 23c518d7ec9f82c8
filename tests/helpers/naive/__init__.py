"""Naive algorithms that only tests use: steps, ranges, fields and shaken floors, circles, time steps."""
