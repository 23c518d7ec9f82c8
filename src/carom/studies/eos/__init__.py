"""Equation-of-state studies: Z over packing fractions, sizes and replicas, on any Executor.

Nothing here holds a published equation of state; ``theory`` does.
"""
