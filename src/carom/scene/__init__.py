"""What is simulated: components, box, walls and obstacles as plain values, checked once.

Nothing here reads files; the simulation sets a scene in motion.
"""
