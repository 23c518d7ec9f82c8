"""Other methods that move hard spheres, each as fast as possible: compiled, with tuned lists of pairs.

``carom trade`` compares the engine with them. They share no code with the engine.
"""
