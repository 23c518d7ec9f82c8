"""Figures of results and frames.

Nothing here computes a result or moves a component.
"""
