"""One run of a scene file: its folder, its phases, its report.

What concerns many runs is in the other studies.
"""
