"""Naive algorithms that only tests use: steps, range rules, a field with shaken floors, great circles, a time step."""
