"""One physics a file: a value that users write, and beside it what the engine compiles for it.

No model imports another's file, the engine or Numba; what several of them need is in ``interface``,
``contact`` and ``steps``.
"""
