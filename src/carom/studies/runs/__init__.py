"""One run of a scene file: its folder, its phases, its report.

Nothing here concerns many runs; the other studies do.
"""
