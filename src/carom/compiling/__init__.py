"""What the engine needs of Numba, its private parts included; nowhere else is one of them used.

Nothing here knows physics or a scene.
"""
