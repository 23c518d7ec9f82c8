"""Drawings of frames and obstacles, and the page that shows them in a browser: of no scene and no file."""
