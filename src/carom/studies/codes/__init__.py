"""Spherical codes: caps that grow on a sphere until they jam, and a polish to 30 digits.

The simulation moves the caps, with the model of great circles.
"""
