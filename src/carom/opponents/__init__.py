"""Other ways to move hard spheres, at their best: compiled, with lists tuned to the step.

What :func:`carom.studies.trade` measures the engine against. Nothing here is shared with the engine.
"""
