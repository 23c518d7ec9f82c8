"""One box in several processes, each run by a thread: slabs, whose turn it is, what is kept or rolled back.

All processes work on one state. Nothing here starts a thread.
"""
