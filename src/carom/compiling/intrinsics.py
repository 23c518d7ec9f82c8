"""Functions in plain Python for which compiled code takes instructions of its own."""

from __future__ import annotations

from numba import types

from carom.compiling.numba_parts import infer, infer_global, make_intrinsic_template


def compiled_as(function):
    """Let compiled code take the decorated intrinsic's instructions for a ``function`` of its parameters.

    They are written where it is called: room on the stack ends with the function that asked for it.
    """

    def decorate(answer):
        template = make_intrinsic_template(function, answer, function.__name__)
        infer(template)
        infer_global(function, types.Function(template))
        return answer

    return decorate
