"""Spherical codes: caps that grow on a sphere until they jam, and a polish to 30 digits.

Nothing here moves a cap; the simulation does, with the model of great circles.
"""
