"""The main cycle and its arrays: it knows events, not physics.

Nothing here knows what a scene is, reads a file, or chooses a model: parts are placed as they are given.
"""
