"""Viscosity and normal stresses of sheared fluids against the shear rate.

Nothing here shears a box; the engine does.
"""
