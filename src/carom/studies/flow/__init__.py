"""Viscosity and normal stresses of sheared fluids against the shear rate."""
