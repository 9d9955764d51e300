"""Pixels across an edge, gathered in narrow bins, and the profile fitted to them."""

from dataclasses import dataclass
from math import ceil, cos, floor, sin

import numpy as np

from .._typing import FloatArray, Image
from ..edges.strip import Frame
from ..photo import full_scale, planes

# Width of the bins in which pixels are gathered, in units of the half-width of a fit: within
# one, a profile bends so little that only the mean distance of its pixels matters.
BIN = 1 / 12
# Half-width of the local fits, in units of the largest gap between the distances at which
# there are pixels: 3 of them lie within, wherever the fit is centered. Along an edge that runs
# along the pixel grid the gap is a pixel; a slanted edge has pixels at nearly any distance.
HALF = 1.75
NARROWEST = 0.8  # half-width in pixels: less would only bring noise


@dataclass(frozen=True, slots=True, eq=False)
class FineProfile:
    """All pixels along an edge, in narrow bins of their distance from it.

    Parameters
    ----------
    place : ndarray, shape (F,)
        Mean distance of the pixels of each bin from the edge, pixels, increasing.
    count : ndarray, shape (F,)
        Number of pixels in each bin.
    mean, square : ndarray, shape (C, F)
        Mean of their intensity and of its square, in each channel.
    """

    place: FloatArray
    count: FloatArray
    mean: FloatArray
    square: FloatArray

    def half(self, least: float) -> float:
        """Half-width of local fits that always find enough pixels, not less than `least`."""
        gap = float(np.diff(self.place).max(initial=0.0))
        return max(least, min(HALF * gap, HALF), NARROWEST)

    def reversed(self) -> "FineProfile":
        """The profile seen from the other side."""
        return FineProfile(
            -self.place[::-1], self.count[::-1], self.mean[:, ::-1], self.square[:, ::-1]
        )


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Profile at given places: value, variance (C, M) and number of pixels used (M,)."""

    value: FloatArray
    variance: FloatArray
    count: FloatArray


def gather(image: Image, frame: Frame, reach: float, half: float) -> FineProfile:
    """All pixels whose centers project onto an edge, out to `reach` pixels from it.

    They are gathered for local fits of half-width `half`.
    """
    width = BIN * max(half, NARROWEST)
    row, column = pixels_near(image.shape[:2], frame, reach)
    place = (row - frame.center[0]) * sin(frame.angle) + (column - frame.center[1]) * cos(
        frame.angle
    )
    index = np.floor((place + reach) / width).astype(np.int64)
    bins = ceil(2 * reach / width) + 1
    count = np.bincount(index, minlength=bins)
    used = count > 0
    sums = [np.bincount(index, place, bins)]
    for plane in planes(image):
        values = plane[row, column] / full_scale(image)
        sums += [np.bincount(index, values, bins), np.bincount(index, values**2, bins)]
    means = np.array(sums)[:, used] / count[used]
    return FineProfile(means[0], count[used].astype(np.float64), means[1::2], means[2::2])


def pixels_near(
    shape: tuple[int, ...], frame: Frame, reach: float
) -> tuple[FloatArray, FloatArray]:
    """Row and column of the pixels in a turned rectangle: half open, inside the image."""
    s, c = sin(frame.angle), cos(frame.angle)
    corners = [frame.point(t * frame.length / 2, d * reach) for t in (-1, 1) for d in (-1, 1)]
    first = max(ceil(min(r for r, _ in corners)), 0)
    last = min(floor(max(r for r, _ in corners)), shape[0] - 1)
    rows = np.arange(first, last + 1)
    y = rows - frame.center[0]
    # Both |along| <= length / 2 and |across| <= reach bound the columns of each row.
    low, high = np.full(len(rows), -np.inf), np.full(len(rows), np.inf)
    for level, slope, bound in ((-c * y, s, frame.length / 2), (s * y, c, reach)):
        if abs(slope) > 1e-9:
            ends = np.sort([(-bound - level) / slope, (bound - level) / slope], axis=0)
            low, high = np.maximum(low, ends[0]), np.minimum(high, ends[1])
        else:
            high = np.where(np.abs(level) <= bound, high, -np.inf)
    low = np.ceil(np.maximum(low + frame.center[1], 0)).astype(np.int64)
    high = np.floor(np.clip(high + frame.center[1], -1, shape[1] - 1)).astype(np.int64)
    count = np.maximum(high - low + 1, 0)
    start = np.repeat(low - np.cumsum(count) + count, count)
    return np.repeat(rows, count), np.arange(count.sum()) + start


def fit_profile(fine: FineProfile, position: FloatArray, half: float, floor: float) -> Fit:
    """Local quadratic fits: the profile itself, not its mean over a bin.

    A mean over a bin would smooth a blurred step; a parabola follows it up to its third
    derivative, and does not mind at which distances the pixels happen to lie.

    Parameters
    ----------
    fine : FineProfile
        Pixels across the edge, F bins.
    position : ndarray, shape (M,)
        Where the profile is wanted, pixels from the edge.
    half : float
        Half-width of each fit, pixels.
    floor : float
        Least variance of one pixel: that of rounding.
    """
    u = (fine.place - position[:, None]) / half
    weight = np.maximum(1 - u**2, 0)
    powers = np.stack([np.ones_like(u), u, u**2])
    weighted = weight * fine.count
    moments = np.einsum("mf,imf,jmf->mij", weighted, powers, powers)
    scale = np.maximum(moments[:, 0, 0], 1e-12)
    # Where fewer than 3 distances are at hand, this leaves a line, or a mean.
    moments += scale[:, None, None] * np.diag([0, 1e-9, 1e-8])
    empty = moments[:, 0, 0] <= 0
    moments[empty] = np.eye(3)
    kernel = np.einsum("mij,jmf->imf", np.linalg.inv(moments), powers) * weight
    coefficients = np.einsum("imf,f,cf->cim", kernel, fine.count, fine.mean)
    fitted = np.einsum("cim,imf->cmf", coefficients, powers)
    misfit = fine.square[:, None] - 2 * fitted * fine.mean[:, None] + fitted**2
    spread = np.maximum((weighted * misfit).sum(axis=2) / scale, 0)
    count = ((weight > 0) * fine.count).sum(axis=1)
    spread *= count / np.maximum(count - 3, 1)  # three coefficients were fitted
    variance = np.maximum(spread, floor) * (kernel[0] ** 2 * fine.count).sum(axis=1)
    return Fit(coefficients[:, 0], variance, np.where(empty, 0, count))


def rounding_variance(image: Image) -> float:
    """Variance of rounding to whole numbers, in units of full scale; next to 0 for floats."""
    return max(1 / full_scale(image) ** 2 / 12, 1e-12) if image.dtype.kind == "u" else 1e-12
