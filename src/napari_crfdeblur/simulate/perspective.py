"""Flat surfaces seen at an angle: drawing on a wall, in the wall's own coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from .._typing import FloatArray
from ..edges.base import Line
from ..response import SRGB
from .raster import paint

Box = tuple[float, float, float, float]
"""Left, top, right, bottom in a surface's coordinates."""


@cache  # thousands of shapes have a few dozen colors
def light_of(color: str) -> FloatArray:
    """Linear light of a color as designers write it, '#rrggbb' in sRGB: shape (3,), read-only."""
    light = SRGB().to_irradiance([int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    light.setflags(write=False)
    return light


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A rectangle in space on which one draws, seen in perspective.

    Coordinates run from (0, 0), top left, to (1, 1), bottom right, and may lie outside.

    Parameters
    ----------
    canvas : ndarray, shape (M, N, 3)
        Linear irradiance, drawn on in place.
    corners : sequence of 4 (float, float)
        Where top left, top right, bottom right and bottom left lie: (row, column) as shares
        of the canvas.
    light : float
        Illumination, which multiplies every color.
    lines : list of Line
        Collects the sides of every :meth:`facet`, in pixels.
    """

    canvas: FloatArray
    corners: Sequence[tuple[float, float]]
    light: float = 1.0
    lines: list[Line] = field(default_factory=list)

    def to_image(self, points: ArrayLike) -> FloatArray:
        """Pixels (row, column) of points (x, y) of the surface, shape (V, 2)."""
        xy = np.asarray(points, dtype=np.float64)
        homography = _homography(tuple((row, column) for row, column in self.corners))
        projected = np.column_stack([xy, np.ones(len(xy))]) @ homography.T
        shares = projected[:, :2] / projected[:, 2:]
        return np.asarray(shares * self.canvas.shape[:2] - 0.5)

    def shape(self, points: ArrayLike, color: str, *, opacity: float = 1.0) -> None:
        """Paint a polygon, (x, y) points of shape (V, 2)."""
        light = self.light * light_of(color)
        paint(self.canvas, [self.to_image(points)], light, opacity=opacity)

    def facet(self, points: ArrayLike, color: str) -> None:
        """Paint a polygon and note its sides as possible edges."""
        self.shape(points, color)
        corners = [(row, column) for row, column in self.to_image(points).tolist()]
        sides = zip(corners, [*corners[1:], corners[0]], strict=True)
        self.lines.extend(Line(start, end) for start, end in sides)

    def panel(self, box: Box, color: str) -> "Surface":
        """Paint a rectangle, note its sides, and return it as a surface to draw on."""
        left, top, right, bottom = box
        self.facet([(left, top), (right, top), (right, bottom), (left, bottom)], color)
        return self.part(box)

    def part(self, box: Box) -> "Surface":
        """A rectangle of this surface as a surface of its own."""
        left, top, right, bottom = box
        corners = self.to_image([(left, top), (right, top), (right, bottom), (left, bottom)])
        shares = (corners + 0.5) / self.canvas.shape[:2]
        return Surface(self.canvas, shares.tolist(), self.light, self.lines)

    def text(self, words: str, box: Box, color: str) -> None:
        """Write bold words that fill a box."""
        from matplotlib.font_manager import FontProperties
        from matplotlib.textpath import TextPath

        path = TextPath((0, 0), words, size=20, prop=FontProperties(weight="bold"))
        frame = path.get_extents()
        size = np.array([box[2] - box[0], box[1] - box[3]]) / [frame.width, frame.height]
        origin = np.array([box[0], box[3]])
        outlines = [
            self.to_image(origin + (outline - [frame.x0, frame.y0]) * size)
            for outline in map(np.asarray, path.to_polygons())
        ]
        paint(self.canvas, outlines, self.light * light_of(color))


@lru_cache(16)  # most shapes are drawn on a few surfaces, one after the other
def _homography(corners: tuple[tuple[float, float], ...]) -> FloatArray:
    """Matrix (3, 3) from (x, y, 1) of the unit square to (row, column, 1) of its corners."""
    rows, right = [], []
    for (x, y), (row, column) in zip([(0, 0), (1, 0), (1, 1), (0, 1)], corners, strict=True):
        rows.append([x, y, 1, 0, 0, 0, -row * x, -row * y])
        rows.append([0, 0, 0, x, y, 1, -column * x, -column * y])
        right += [row, column]
    solution = np.linalg.solve(np.array(rows, dtype=np.float64), np.array(right))
    return np.append(solution, 1.0).reshape(3, 3)
