"""What the engine asks of a model that remembers something."""

from __future__ import annotations

from carom.compiling.registry import optional


@optional
def shift_epoch(pair, duration):
    """Refer arrays that depend on time to the start of the next epoch, ``duration`` later.

    By default there are none.
    """
    return


@optional
def error_message(pair):
    """Return a sentence that says why the run cannot continue, or None; called often from Python."""
    return


@optional
def copy_state(model, before, instant, passed, slower):
    """Copy the memory of ``before``, a model of the same type that is replaced; called from Python.

    :meth:`carom.Simulation.rescale` and growing diameters replace models. A model that answers
    :func:`shift_epoch` or ``record_impulse`` has to answer this, too.

    Parameters
    ----------
    model, before : models
        The new model of a pair interaction, an impact or an obstacle, and the model that it replaces.
    instant : Fraction
        Present time since the start of the run, in the unit of the new model. Its epochs begin then.
    passed : float
        Present time since the beginning of the epoch, in the unit of the old model.
    slower : int
        The unit of time of the new model is longer by ``2**slower``.
    """
    return
