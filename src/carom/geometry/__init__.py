"""Where spheres are in a box: nearest images, pairs near each other, neighbors, overlaps, obstacles.

Nothing here knows a scene, or what happens in time.
"""
