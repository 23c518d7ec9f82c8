"""One box in several parts, each run by a thread: slabs, whose turn it is, and what each part counts.

All parts work on one state. Nothing here starts a thread.
"""
