"""What watches events and adds something up, a quantity a file, behind one interface.

The engine tells its observers of every event, and of the time that passes. Where there are none they cost
nothing.
"""
