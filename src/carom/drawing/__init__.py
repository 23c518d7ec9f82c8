"""Drawings of frames and obstacles, and the page that shows them in a browser.

Nothing here knows a scene, or reads a file.
"""
