"""Other methods that move hard spheres, each at its best: compiled, with lists of pairs tuned to the step.

:func:`carom.studies.trade` compares the engine with them. They share no code with the engine.
"""
