"""Other methods that move hard spheres, each at its best: compiled, with lists of pairs tuned to the step.

``carom trade`` compares the engine with them. They share no code with the engine.
"""
