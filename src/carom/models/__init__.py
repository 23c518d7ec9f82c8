"""One physics per file: a value that users write, and the type that the engine compiles for it.

No model imports another's file, the engine or Numba; shared code is in ``interface``, ``contact`` and
``steps``.
"""
