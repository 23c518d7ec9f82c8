"""Frames as objects of other programs: ASE, freud, OVITO, pandas and xarray. None of them is required.

Nothing here reads or writes a file, or makes a frame: ``io`` does that.
"""
