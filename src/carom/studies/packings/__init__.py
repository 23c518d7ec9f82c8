"""Compression of a scene until it jams, and what is known of the packing.

Nothing here knows how components grow: that is the simulation's.
"""
