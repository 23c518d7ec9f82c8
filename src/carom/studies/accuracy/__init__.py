"""The speed-accuracy front: methods, what is measured of them, the table and its picture.

Only here do the engine and the reference methods meet.
"""
