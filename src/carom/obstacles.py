"""Planes, balls and containers under the name that scripts import them by; they live in ``carom.models``."""

from carom.models.obstacles import Ball, CylindricalContainer, Obstacle, Plane, SphericalContainer, walls

__all__ = ["Ball", "CylindricalContainer", "Obstacle", "Plane", "SphericalContainer", "walls"]
