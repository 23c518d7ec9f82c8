"""How two components act on each other, a file a physics.

Nothing here knows how they move, or who is near.
"""
