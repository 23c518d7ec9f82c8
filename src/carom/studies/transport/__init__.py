"""Transport coefficients from replicas of a fluid in equilibrium, by Einstein's and Helfand's relations.

Nothing here sums a current; the engine and the simulation do.
"""
