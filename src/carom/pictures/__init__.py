"""Pictures, movies and pages of runs, files, scenes and packings.

``paper``, the look of figures, is ``carom.figures.style`` now.
"""
