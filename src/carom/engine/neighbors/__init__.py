"""Who can meet whom next: sectors and lists behind one interface, and the rule that chooses between them.

Nothing here knows how components interact, only how far.
"""
