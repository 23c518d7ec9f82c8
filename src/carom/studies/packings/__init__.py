"""Compression of a scene until it jams, and the results for the packing.

Nothing here knows how particles grow; the simulation does.
"""
