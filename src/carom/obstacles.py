"""What stands in a scene, under the name that scripts import it by; it lives in ``carom.models``."""

from carom.models.obstacles import (
    Arc,
    Ball,
    Box,
    CylindricalContainer,
    Obstacle,
    Plane,
    Segment,
    SphericalContainer,
    Triangle,
    polygon,
    walls,
)

__all__ = [
    "Arc",
    "Ball",
    "Box",
    "CylindricalContainer",
    "Obstacle",
    "Plane",
    "Segment",
    "SphericalContainer",
    "Triangle",
    "polygon",
    "walls",
]
