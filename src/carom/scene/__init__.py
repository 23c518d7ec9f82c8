"""What is simulated: components, box, walls and obstacles as plain values, checked once.

What a file holds ``io`` reads, and only the simulation sets a scene in motion.
"""
