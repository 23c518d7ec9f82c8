"""Who can meet whom next: sectors and lists behind one interface, and the rule that chooses between them.

A scheme asks a model how far pairs act, and when two could meet; what then happens it does not know.
"""
