"""Whole studies: runs with a folder of results, packings, equations of state, transport, spherical codes.

Nothing here knows how a particle moves; the simulation does. What users call is in ``carom``.
"""
