"""One run of a scene file: its folder, its phases, its report.

Nothing here concerns many runs: that is in the other studies.
"""
