"""One box in several processes, each run by a thread: slabs, whose turn it is, and what each process counts.

All processes work on one state. Nothing here starts a thread.
"""
