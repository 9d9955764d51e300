"""The picture as an edge sees it: intensity on a grid along and across a line."""

from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin

import numpy as np
from scipy import ndimage

from .._typing import FloatArray, Image
from ..photo import full_scale, planes
from .base import Line, Point

# Rows of a strip: enough to average an edge of any length, and a bound on the time it takes.
MOST_ROWS = 128


@dataclass(frozen=True, slots=True)
class Frame:
    """Coordinates of an edge: `t` along it and `d` across it, from its middle.

    A point is ``center + t * tangent + d * normal``, with ``normal = (sin a, cos a)`` and
    ``tangent = (-cos a, sin a)`` for the angle `a` of the normal.

    Parameters
    ----------
    center : (float, float)
        Middle of the edge, (row, column) pixels.
    angle : float
        Angle of the normal, radians from the column axis towards the row axis.
    length : float
        Length of the edge in pixels.
    """

    center: Point
    angle: float
    length: float

    @classmethod
    def of(cls, line: Line) -> "Frame":
        """The frame of a line; its normal lies in [0, pi), as that of an edge."""
        (r0, c0), (r1, c1) = line.start, line.end
        angle = (atan2(r1 - r0, c1 - c0) + pi / 2) % pi
        return cls(((r0 + r1) / 2, (c0 + c1) / 2), angle, hypot(r1 - r0, c1 - c0))

    @property
    def line(self) -> Line:
        """The line from one end to the other."""
        return Line(self.point(-self.length / 2, 0), self.point(self.length / 2, 0))

    def point(self, along: float, across: float) -> Point:
        """Point of the image, (row, column), at the given distances from the middle."""
        row = self.center[0] - along * cos(self.angle) + across * sin(self.angle)
        column = self.center[1] + along * sin(self.angle) + across * cos(self.angle)
        return row, column

    def moved(self, offset: float, slope: float) -> "Frame":
        """The frame of the line ``d = offset + slope * t``."""
        # d grows with t: the normal turns from (0, 1) to (-slope, 1) in (t, d) coordinates.
        angle = self.angle + atan2(slope, 1.0)
        return Frame(self.point(0, offset), angle, self.length)

    def part(self, first: float, last: float) -> "Frame":
        """The frame of the part from `first` to `last` along the edge."""
        return Frame(self.point((first + last) / 2, 0), self.angle, last - first)


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """Intensity around a line, interpolated on a grid along and across it.

    Parameters
    ----------
    values : ndarray, shape (T, D, C)
        Intensity in [0, 1] in each channel; NaN outside the image.
    along : ndarray, shape (T,)
        Distance along the line from its middle, pixels.
    across : ndarray, shape (D,)
        Distance along the normal, pixels, spaced by 1.
    """

    values: FloatArray
    along: FloatArray
    across: FloatArray

    @property
    def spacing(self) -> float:
        """Distance between two rows, pixels."""
        return float(self.along[1] - self.along[0])


def sample_strip(image: Image, frame: Frame, reach: float, most_rows: int = MOST_ROWS) -> Strip:
    """Sample the image around a line, out to `reach` pixels on both sides.

    Bilinear: good enough to find an edge and to judge it; its profile is measured from the
    pixels themselves.
    """
    rows = int(np.clip(round(frame.length), 4, most_rows))
    along = ((np.arange(rows) + 0.5) / rows - 0.5) * frame.length
    across = np.arange(-np.ceil(reach), np.ceil(reach) + 1)
    s, c = sin(frame.angle), cos(frame.angle)
    r = frame.center[0] - along[:, None] * c + across * s
    q = frame.center[1] + along[:, None] * s + across * c
    scale = np.float32(1 / full_scale(image))
    values = np.empty((*r.shape, len(planes(image))), dtype=np.float32)
    for i, plane in enumerate(planes(image)):
        values[..., i] = interpolate(plane, r, q)
    values *= scale
    return Strip(values, along, across)


def interpolate(plane: Image, row: FloatArray, column: FloatArray) -> FloatArray:
    """Bilinear interpolation at the given points, float32, NaN outside."""
    found: FloatArray = ndimage.map_coordinates(
        plane, (row, column), order=1, output=np.float32, mode="constant", cval=np.nan
    )
    return found
