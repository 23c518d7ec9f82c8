"""Copies of models: what is tried, or run, leaves the memory of a value alone."""

from __future__ import annotations

from typing import Any

import numpy as np


def copied(model: Any) -> Any:
    """Return a model with copies of its arrays."""
    if isinstance(model, np.ndarray):
        return model.copy()
    if hasattr(model, "_fields"):
        return model._replace(**{name: copied(getattr(model, name)) for name in model._fields})
    if isinstance(model, tuple):
        return tuple(map(copied, model))
    return model
