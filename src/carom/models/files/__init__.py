"""What files hold of models, and how that becomes a value again.

No file is opened here.
"""
