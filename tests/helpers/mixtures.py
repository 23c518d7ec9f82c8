"""Species from lists of their properties, where a test computes these."""

import carom


def mixed(*, counts=None, fractions=None, diameters, masses=None, names=None):
    """Return the species with the properties of each."""
    k = range(len(diameters))
    return [
        carom.Species(
            names[i] if names else None,
            fraction=None if fractions is None else fractions[i],
            count=None if counts is None else counts[i],
            diameter=diameters[i],
            mass=1.0 if masses is None else masses[i],
        )
        for i in k
    ]


def mixture(counts=None, *, n=None, fractions=None, diameters, masses=None, names=None, **more):
    """Return spheres of several species at random, from lists of the properties of each."""
    species = mixed(counts=counts, fractions=fractions, diameters=diameters, masses=masses, names=names)
    return carom.Scene.random(n, species=species, **more)
