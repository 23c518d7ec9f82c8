"""What a run measures: samples, stretches of equal length, equilibrium, energies, Helfand's moments.

Sampling and measuring do not change the trajectory; ``equilibrate``, which scales velocities, does.
"""
