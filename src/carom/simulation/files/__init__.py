"""What a run leaves in files, and how it goes on from them: checkpoints, event logs, rows of numbers.

Formats of frames are not here: they are of ``io``.
"""
