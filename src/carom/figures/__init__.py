"""What draws curves, bands and tables, from arrays: every result can draw itself with it.

Nothing here knows a result or a frame.
"""
