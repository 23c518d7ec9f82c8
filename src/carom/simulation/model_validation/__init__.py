"""What is tried of models of one's own, in plain Python, before a simulation compiles them.

Models of Carom are not tried here: its tests do that.
"""
