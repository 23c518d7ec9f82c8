"""Figures of results and frames.

Nothing here computes results or runs a simulation.
"""
