"""One system on several threads: who runs which part, for how long, and what to do where a window is lost.

What the parts do is the engine's (``engine/domains``). Nothing here computes a contact.
"""
