"""Scene files: the words of TOML, checked, and the scene, the run and the output that they describe.

Nothing here runs anything.
"""
