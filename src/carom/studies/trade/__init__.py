"""The speed-accuracy front: methods, their measures, the table and its picture.

The engine and the reference methods are compared only here. No simulation needs this package.
"""
