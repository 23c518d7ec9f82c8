"""One system on several threads: who runs which part, for how long, and what to do where parts disagree.

The copies and their comparison are the engine's (``engine/windows``). Nothing here computes a contact.
"""
