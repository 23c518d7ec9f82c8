"""An estimate of the pressure from blocks drawn at random, and means of correlated samples."""

import numpy as np

from carom import theory
from carom.block import Block
from carom.observables.pressure import Pressure
from carom.observables.statistics import blocking


def estimate(dimension=3, blocks=100, n=50, eta=0.2, **more):
    rng = np.random.default_rng(dimension)
    volume = n * theory.ball_volume(dimension) / eta
    data = [Block(1.0, 200, float(rng.normal(300.0, 9.0))) for _ in range(blocks)]
    return Pressure.estimate(data, n=n, dimension=dimension, volume=volume, diameter=1.0, kT=1.0, **more)


def agrees(values, exact, sigmas=4.0):
    """Tell whether a mean of correlated samples is within so many standard errors of an exact value."""
    found = blocking(np.asarray(values, float))
    return abs(found.mean - exact) < sigmas * found.error
