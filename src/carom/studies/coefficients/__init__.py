"""Transport coefficients from replicas of a fluid in equilibrium, by Einstein's and Helfand's relations.

The engine and the simulation, not this package, sum the currents.
"""
