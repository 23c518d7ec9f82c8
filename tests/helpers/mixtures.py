"""Species from lists of their properties, where a test computes these."""

import carom


def mixed(*, counts=None, fractions=None, diameters=None, masses=None, names=None):
    """Return the species with the properties of each; all of size and mass 1 unless given."""
    given = {"name": names, "count": counts, "fraction": fractions, "diameter": diameters, "mass": masses}
    given = {key: values for key, values in given.items() if values is not None}
    return [carom.Species(**dict(zip(given, row, strict=True))) for row in zip(*given.values(), strict=True)]


def mixture(counts=None, *, n=None, fractions=None, diameters=None, masses=None, names=None, **more):
    """Return spheres of several species at random, from lists of the properties of each."""
    species = mixed(counts=counts, fractions=fractions, diameters=diameters, masses=masses, names=names)
    return carom.Scene.random(n, species=species, **more)
