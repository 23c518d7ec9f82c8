"""What several models compute with: roots, double doubles, random numbers by counting.

Nothing here is a model.
"""
