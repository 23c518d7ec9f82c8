"""One run of a scene file: its folder, its phases, its report.

The other studies concern many runs.
"""
