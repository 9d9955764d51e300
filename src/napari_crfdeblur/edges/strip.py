"""The picture as an edge sees it: intensity on a grid along and across a line."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin

import numpy as np

from .._typing import FloatArray
from .base import Line, Point
from .picture import Picture
from .sampling import Grids, interpolated

# Rows of a strip; the most are enough to average an edge of any length, in a bounded time.
ROWS = (8, 16, 24, 32, 48, 64, 96)


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

    def reduced(self, step: int) -> "Frame":
        """The frame in a picture of which each pixel is `step` pixels wide."""
        row, column = ((x - (step - 1) / 2) / step for x in self.center)
        return Frame((row, column), self.angle, self.length / step)

    def enlarged(self, step: int) -> "Frame":
        """The frame in the photo, for one in a picture; undoes :meth:`reduced`."""
        row, column = (x * step + (step - 1) / 2 for x in self.center)
        return Frame((row, column), self.angle, self.length * step)

    def part(self, first: float, last: float) -> "Frame":
        """The frame of the part from `first` to `last` along the edge."""
        return Frame(self.point((first + last) / 2, 0), self.angle, last - first)


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """Intensity around a line, interpolated on a grid along and across it.

    Parameters
    ----------
    values : ndarray, shape (C, T, D)
        Intensity in [0, 1] in each channel; NaN outside the image.
    along : ndarray, shape (T,)
        Distance along the line from its middle, pixels.
    across : ndarray, shape (D,)
        Distance along the normal, pixels, spaced by 1.
    profile : ndarray, shape (C, D)
        Mean along the line in each channel, of what lies in the image.
    weights : ndarray, shape (C,)
        The color in which the two sides differ most; see :func:`contrasting`.
    signal : ndarray, shape (T, D)
        Intensity along that color.
    """

    values: FloatArray
    along: FloatArray
    across: FloatArray
    profile: FloatArray
    weights: FloatArray
    signal: FloatArray

    @property
    def spacing(self) -> float:
        """Distance between two rows, pixels."""
        return float(self.along[1] - self.along[0])


@dataclass(frozen=True, slots=True, eq=False)
class Strips:
    """The strips of several lines, all with as many rows: fields of :class:`Strip`, stacked.

    Parameters
    ----------
    values : ndarray, shape (C, K, T, D)
    along : ndarray, shape (K, T)
    across : ndarray, shape (D,)
    profile : ndarray, shape (C, K, D)
    weights : ndarray, shape (C, K)
    signal : ndarray, shape (K, T, D)
    """

    values: FloatArray
    along: FloatArray
    across: FloatArray
    profile: FloatArray
    weights: FloatArray
    signal: FloatArray

    def __getitem__(self, k: int) -> Strip:
        return Strip(
            self.values[:, k],
            self.along[k],
            self.across,
            self.profile[:, k],
            self.weights[:, k],
            self.signal[k],
        )


def sample_strip(picture: Picture, frame: Frame, reach: float) -> Strip:
    """Sample the picture around a line, out to `reach` pixels on both sides."""
    return sample_strips(picture, [frame], reach, rows_for(frame.length))[0]


def strips_along(
    picture: Picture, frames: Sequence[Frame], reach: float, most: int = ROWS[-1]
) -> list[Strip]:
    """Sample the picture around many lines, each like :func:`sample_strip`, in their order.

    With `most` rows at most.
    """
    rows = np.array([min(rows_for(frame.length), most) for frame in frames])
    strips: dict[int, Strip] = {}
    for number in np.unique(rows):
        chosen = np.flatnonzero(rows == number).tolist()
        together = sample_strips(picture, [frames[i] for i in chosen], reach, int(number))
        strips.update((i, together[k]) for k, i in enumerate(chosen))
    return [strips[i] for i in range(len(frames))]


def rows_for(length: float) -> int:
    """Rows of the strip of an edge: about one for each pixel, up to a limit.

    A few numbers only, so that many edges share theirs.
    """
    return next((rows for rows in ROWS if length < 1.25 * rows), ROWS[-1])


def sample_strips(picture: Picture, frames: Sequence[Frame], reach: float, rows: int) -> Strips:
    """Sample the picture around lines, out to `reach` pixels on both sides.

    Bilinear: good enough to find an edge and to judge it; its profile is measured from the
    pixels themselves.
    """
    center = np.array([frame.center for frame in frames])
    angle = np.array([frame.angle for frame in frames])
    length = np.array([frame.length for frame in frames])
    along = ((np.arange(rows) + 0.5) / rows - 0.5) * length[:, None]
    across = np.arange(-np.ceil(reach), np.ceil(reach) + 1)
    normal = np.stack([np.sin(angle), np.cos(angle)], axis=1)
    values = interpolated(picture, Grids(center, normal, along, across))
    profile = mean_valid(values, 2)
    weights = contrasting(profile, across)
    # Channel by channel, so that it is summed in one pass without copies.
    signal = values[0] * weights[0, :, None, None]
    for plane, weight in zip(values[1:], weights[1:], strict=True):
        signal += plane * weight[:, None, None]
    return Strips(values, along, across, profile, weights, signal)


def contrasting(profile: FloatArray, across: FloatArray) -> FloatArray:
    """Weights of the channels, (C, K), under which the sides of profiles (C, K, D) differ most.

    They are the differences between the sides, scaled so that their sizes sum to 1: contrast
    in opposite directions adds instead of cancelling.
    """
    sides = [mean_valid(profile[..., side], 2) for side in (across > 0, across < 0)]
    difference = np.nan_to_num(sides[0] - sides[1])  # NaN if a side lies outside the image
    total = np.abs(difference).sum(axis=0)
    top = np.abs(difference).argmax(axis=0)[None]
    scale = np.copysign(total, np.take_along_axis(difference, top, axis=0))[0]
    even = np.full_like(difference, 1 / len(difference))
    weights: FloatArray = np.divide(difference, scale, out=even, where=total > 0)
    return weights


def mean_valid(values: FloatArray, axis: int) -> FloatArray:
    """Mean over the finite values along an axis; NaN where there are none."""
    mean: FloatArray = values.mean(axis=axis)
    if np.isfinite(mean).all():
        return mean
    valid = np.isfinite(values)
    count = valid.sum(axis=axis)
    total = np.where(valid, values, 0).sum(axis=axis)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return mean
