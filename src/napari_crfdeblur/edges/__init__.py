"""The stage from photo to edges: straight steps between two homogeneous areas."""

from .base import Edge, EdgeStatus, Line, Point, Rectangle
from .detect import find_edges, finding_edges
from .extent import estimate_blur_extent, estimating_blur_extent
from .refine import refine_edges, refining_edges

__all__ = [
    "Edge",
    "EdgeStatus",
    "Line",
    "Point",
    "Rectangle",
    "estimate_blur_extent",
    "estimating_blur_extent",
    "find_edges",
    "finding_edges",
    "refine_edges",
    "refining_edges",
]
