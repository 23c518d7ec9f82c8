"""From the engine's Python to machine code: the language, its translation, LLVM, and code on disk.

Nothing here knows physics or a scene.
"""
