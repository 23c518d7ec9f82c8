"""Random numbers by counting: the k-th draw of a component is a function of seed, component and k.

The hash is PCG's output permutation (Jarzynski and Olano, J. Comput. Graph. Tech. 9 (2020) 20), chained over
the key. Products fit 63 bits, so that plain Python agrees. A checkpoint holds how many each has drawn.
"""

from __future__ import annotations

import math

WORD = 0xFFFFFFFF  # 32 bits


def mixed(bits64):
    """Return the hash of 32 bits."""
    state = (bits64 * 747796405 + 2891336453) & WORD
    state = (((state >> ((state >> 28) + 4)) ^ state) * 277803737) & WORD
    return (state >> 22) ^ state


def uniform(seed, i, k):
    """Return draw k of particle i from the stream of a ``seed``, in (0, 1], of 52 bits."""
    bits64 = mixed(seed & WORD)
    bits64 = mixed(bits64 ^ ((seed >> 32) & WORD))
    bits64 = mixed(bits64 ^ i)
    bits64 = mixed(bits64 ^ (k & WORD))
    bits64 = mixed(bits64 ^ ((k >> 32) & WORD))
    low = mixed(bits64 ^ 0x5BF03635)
    high = mixed(low ^ bits64)
    return (float((high >> 6) * 67108864 + (low >> 6)) + 1.0) * 2.0**-52


def normal(seed, i, k):
    """Return a normal number of the stream of a ``seed`` (Box and Muller).

    It takes the draws k and k + 1 of particle i.
    """
    size = math.sqrt(-2.0 * math.log(uniform(seed, i, k)))
    return size * math.cos(2.0 * math.pi * uniform(seed, i, k + 1))
