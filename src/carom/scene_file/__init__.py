"""Scene files: reading and checking TOML, and the scene, run and output that a file describes.

Nothing here runs a simulation.
"""
