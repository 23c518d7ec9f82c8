"""The speed-accuracy front: methods, their measures, the table and its picture.

Only here do the engine and the reference methods meet; nothing here is needed to simulate.
"""
