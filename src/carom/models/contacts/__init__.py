"""What a contact of two components loses.

Nothing else of a contact is known here.
"""
