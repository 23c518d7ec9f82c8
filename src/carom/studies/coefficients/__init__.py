"""Transport coefficients from replicas of a fluid in equilibrium, by Einstein's and Helfand's relations.

Nothing here adds up a current: that is the engine's and the simulation's.
"""
