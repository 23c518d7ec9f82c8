"""What a run measures: samples, stretches of equal length, equilibrium, energies, Helfand's moments.

Nothing here changes the trajectory.
"""
