"""Windows of time: parts of the box run by themselves, and are compared afterwards (decision 41).

Each part runs the ordinary main cycle on a copy of the system. These modules make, watch and join the
copies; nothing here starts a thread.
"""
