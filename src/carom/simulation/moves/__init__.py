"""What changes a run between its events: exchanges of diameters, the volume, growth.

Nothing here is an event: a move is tried at its time, and all is scheduled anew where it is accepted.
"""
