"""The stage from photo to edges: straight steps between two homogeneous areas."""

from .base import Edge, EdgeStatus, Line, Point, Rectangle
from .detect import find_edges
from .refine import refine_edges

__all__ = [
    "Edge",
    "EdgeStatus",
    "Line",
    "Point",
    "Rectangle",
    "find_edges",
    "refine_edges",
]
