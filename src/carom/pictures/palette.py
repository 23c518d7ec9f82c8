"""The colors of figures, also readable without color: one strong blue for data, grays and line styles."""

INK = "#1f4e79"
SERIES = (INK, "#b8651b", "#2e7d4f", "#8e3b6f", "#5b5fb0", "#6b6b6b")
"""Of several curves, in their order; with more curves they repeat."""
PALE = "#9dbbd8"
GRAY = "#555555"
WARM = "#c0392b"
THEORIES = ((WARM, "-"), ("#14888c", "--"), (GRAY, ":"), ("#7a3ea8", "-."))
"""Color and line of each of several theories in one picture."""
