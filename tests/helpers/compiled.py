"""What worker processes of tests compile: they import it from here."""


def compiled_there(value):
    """Stand for a task that compiles, on a worker."""
    from numba import njit

    return njit(lambda x: x + value)(1)
