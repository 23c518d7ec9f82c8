"""How components move between two events.

No contact is known here.
"""
