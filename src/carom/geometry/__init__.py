"""Where spheres are in a box: nearest images, pairs near each other, neighbors, overlaps, obstacles."""
