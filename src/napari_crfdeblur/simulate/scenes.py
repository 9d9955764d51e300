"""Scenes in linear light whose straight edges are known."""

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments
from .._typing import FloatArray
from ..edges.base import Edge, Line, Point
from .raster import paint

Levels = tuple[float, ...]
MOST_PIXELS = 1 << 28  # of a scene: 3 gigabytes of color


def checked_shape(shape: tuple[int, int]) -> tuple[int, int]:
    """The shape, if it is that of a picture of at most 268 megapixels."""
    what = "a shape (rows, columns)"
    sides = arguments.numbers(shape, what, count=2)
    rows, columns = (arguments.whole(side, what, least=1, most=MOST_PIXELS) for side in sides)
    if rows * columns > MOST_PIXELS:
        raise arguments.refusal(f"a shape of at most {MOST_PIXELS} pixels", shape)
    return rows, columns


@dataclass(frozen=True, slots=True)
class TrueEdge:
    """A straight edge of a scene, with the light on its two sides.

    Parameters
    ----------
    line : Line
        Where it lies, (row, column) pixels.
    before, after : tuple of float
        Irradiance of each channel on either side; the normal of the edge, as defined for
        :class:`~napari_crfdeblur.edges.base.Edge`, points from `before` to `after`.
    """

    line: Line
    before: Levels
    after: Levels

    def __post_init__(self) -> None:
        arguments.instance(self.line, Line, "a Line")
        for name in ("before", "after"):
            levels = arguments.numbers(getattr(self, name), "irradiance of each channel")
            object.__setattr__(self, name, levels)

    def moved(self, rows: float, columns: float) -> "TrueEdge":
        """The same edge, shifted."""
        (r0, c0), (r1, c1) = self.line.start, self.line.end
        line = Line((r0 + rows, c0 + columns), (r1 + rows, c1 + columns))
        return TrueEdge(line, self.before, self.after)


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What the camera looks at.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, 3)
        Irradiance in [0, 1], float32.
    edges : tuple of TrueEdge
        Its long straight edges between homogeneous areas.
    """

    linear: FloatArray
    edges: tuple[TrueEdge, ...] = ()

    def __post_init__(self) -> None:
        what = "a scene (M, N) or (M, N, 3)"
        given = arguments.array(self.linear, what, finite=True)
        if given.size == 0 or not (given.min() >= 0 and given.max() <= 1):
            raise ValueError("expected irradiance in [0, 1]")
        linear = np.array(given, dtype=np.float32)
        linear.setflags(write=False)
        object.__setattr__(self, "linear", linear)
        edges = arguments.instances(self.edges, TrueEdge, "a tuple of true edges")
        object.__setattr__(self, "edges", tuple(edges))
        if linear.ndim != 2 and not (linear.ndim == 3 and linear.shape[2] == 3):
            raise arguments.refusal(what, linear)


def edge_between(
    start: Point, end: Point, inside: Point, levels: tuple[ArrayLike, ArrayLike]
) -> TrueEdge:
    """True edge from `start` to `end`, given a point on one side.

    Parameters
    ----------
    start, end, inside : (float, float)
        (row, column) pixels.
    levels : pair of array_like, shape () or (C,)
        Irradiance on the side of `inside`, then on the other.
    """
    line = Line(start, end)
    normal = Edge(start, end).normal
    towards = (inside[0] - start[0]) * normal[0] + (inside[1] - start[1]) * normal[1]
    near, far = (tuple(np.atleast_1d(np.asarray(v, dtype=float)).tolist()) for v in levels)
    return TrueEdge(line, far, near) if towards > 0 else TrueEdge(line, near, far)


def step_image(shape: tuple[int, int], levels: Levels = (0.04, 0.4, 0.9, 0.04)) -> Scene:
    """Vertical bars black, gray, white, black: the steps of Kim et al. 2012, Fig. 1.

    The second black bar adds the step over the full range, so that the three steps determine
    a response.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns.
    levels : tuple of float
        Irradiance of the bars, from left to right.
    """
    rows, columns = shape = checked_shape(shape)
    levels = arguments.numbers(levels, "irradiance of each bar", least=0, most=1)
    if not 0 < len(levels) <= columns:
        raise ValueError(f"expected 1 to {columns} bars in {columns} columns, got {len(levels)}")
    linear = np.full(shape, levels[0], dtype=np.float32)
    joints = np.arange(1, len(levels)) * columns / len(levels) - 0.5
    edges = []
    for joint, left, right in zip(joints, levels, levels[1:], strict=False):
        corners = [(-1, joint), (rows, joint), (rows, columns), (-1, columns)]
        paint(linear, [corners], right)
        ends = (0.0, float(joint)), (rows - 1.0, float(joint))
        edges.append(edge_between(*ends, (0.0, float(joint) + 1), (right, left)))
    return Scene(linear, tuple(edges))


def slanted_edges(
    shape: tuple[int, int], *, seed: int = 0, pitch: float = 200.0, channels: int = 1
) -> Scene:
    """Tilted rectangles on fields of other brightness: edges of many directions and ranges.

    Every field and every rectangle has its own brightness, at least 0.2 apart in each
    channel, so that dark sides, bright sides and ranges all differ; with 3 channels each edge
    lies between two different colors.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns.
    seed : int
        The same seed gives the same scene.
    pitch : float
        Side of a field in pixels; a blur of up to 0.17 pitch leaves clean sides.
    channels : int
        1 for a gray scene, 3 for color.
    """
    shape = checked_shape(shape)
    arguments.whole(seed, "a seed", least=0)
    arguments.number(pitch, "a pitch in pixels", least=1)
    if arguments.whole(channels, "1 or 3 channels") not in (1, 3):
        raise arguments.refusal("1 or 3 channels", channels)
    rng = np.random.default_rng(seed)
    linear = np.zeros((*shape, channels), dtype=np.float32)
    fields = [max(1, round(side / pitch)) for side in shape]
    size = np.array(shape) / fields
    edges: list[TrueEdge] = []
    for cell in np.ndindex(*fields):
        corner = size * cell - 0.5
        field, patch = _two_levels(rng, channels)
        paint(linear, [corner + size * [(0, 0), (0, 1), (1, 1), (1, 0)]], field)
        corners = corner + size / 2 + _tilted(rng, 0.26 * min(size))
        paint(linear, [corners], patch)
        edges += outline_edges(corners, (patch, field))
    return Scene(linear[..., 0] if channels == 1 else linear, tuple(edges))


def outline_edges(corners: FloatArray, levels: tuple[ArrayLike, ArrayLike]) -> list[TrueEdge]:
    """The sides of a convex polygon, shape (V, 2), between its inner and its outer level."""
    middle: Point = tuple(corners.mean(axis=0).tolist())
    points: list[Point] = [tuple(corner) for corner in corners.tolist()]
    sides = zip(points, [*points[1:], points[0]], strict=True)
    return [edge_between(start, end, middle, levels) for start, end in sides]


def _tilted(rng: np.random.Generator, half: float) -> FloatArray:
    """Corners, shape (4, 2), of a rectangle about the origin, nearly square, at any angle."""
    angle = rng.uniform(0, pi)
    sides = half * rng.uniform(0.85, 1.0, size=2)
    across = np.array([np.sin(angle), np.cos(angle)])
    along = np.array([np.cos(angle), -np.sin(angle)])
    signs = [(-1, -1), (-1, 1), (1, 1), (1, -1)]
    return np.array([a * sides[0] * across + b * sides[1] * along for a, b in signs])


def _two_levels(rng: np.random.Generator, channels: int) -> tuple[FloatArray, FloatArray]:
    """Two colors, each shape (C,), that are at least 0.2 apart in every channel."""
    first = rng.uniform(0.02, 0.98, size=channels)
    second = rng.uniform(0.02, 0.98, size=channels)
    while np.any(np.abs(second - first) < 0.2):
        again = np.abs(second - first) < 0.2
        first[again], second[again] = rng.uniform(0.02, 0.98, size=(2, again.sum()))
    return first, second
