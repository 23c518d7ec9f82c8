"""Equation-of-state studies: Z over packing fractions, sizes and replicas, on any Executor.

Published equations of state are in ``theory``.
"""
