"""Where an edge runs, to a fraction of a pixel."""

from dataclasses import dataclass
from math import copysign

import numpy as np
from scipy import ndimage

from .._typing import FloatArray, Image
from .strip import Frame, Strip, sample_strip

BLOCKS = 16  # pieces of an edge that are located on their own


@dataclass(frozen=True, slots=True)
class Search:
    """How far from a proposed line the edge may lie, and how wide it may be, in pixels."""

    capture: float
    blur_extent: float


def locate(image: Image, frame: Frame, search: Search) -> Frame | None:
    """The frame moved onto the edge next to it; None if it lies outside the image.

    First every piece of the edge is found by the largest smoothed slope near the line, then
    the pieces are shifted onto their mean profile by :func:`refit`.
    """
    strip = sample_strip(image, frame, search.capture + 0.75 * search.blur_extent + 2, 48)
    found = blocks(strip.along, signal(strip))
    if found is None:
        return None
    along, profiles = found
    shift, weight = steepest(profiles, strip.across, search)
    return refit(image, frame.moved(*fit_line(along, shift, weight)), search.blur_extent)


def refit(image: Image, frame: Frame, blur_extent: float) -> Frame | None:
    """The frame turned and shifted by less than a blur, by least squares of its profiles."""
    strip = sample_strip(image, frame, 0.75 * blur_extent + 4, 96)
    found = blocks(strip.along, signal(strip))
    if found is None:
        return None
    along, profiles = found
    shift = matched(profiles, profiles.mean(axis=0))
    usable = np.abs(shift) < 0.3 * blur_extent + 1  # beyond, the linearization says nothing
    return frame.moved(*fit_line(along, shift, usable.astype(float)))


def signal(strip: Strip) -> FloatArray:
    """Intensity along the color in which the two sides differ most, shape (T, D).

    The weights of the channels are their differences between the sides, scaled so that their
    sizes sum to 1: contrast in opposite directions adds instead of cancelling.
    """
    halves = [strip.values[:, side] for side in (strip.across > 0, strip.across < 0)]
    difference = mean_valid(halves[0], (0, 1)) - mean_valid(halves[1], (0, 1))
    total = np.abs(difference).sum()
    if not total > 0:
        return mean_valid(strip.values, 2)
    weights = difference / copysign(total, difference[np.abs(difference).argmax()])
    projected: FloatArray = strip.values @ weights.astype(np.float32)
    return projected


def mean_valid(values: FloatArray, axis: int | tuple[int, ...]) -> FloatArray:
    """Mean over the finite values along an axis; NaN where there are none."""
    mean: FloatArray = values.mean(axis=axis)
    if np.isfinite(mean).all():
        return mean
    valid = np.isfinite(values)
    count = valid.sum(axis=axis)
    total = np.where(valid, values, 0).sum(axis=axis)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return mean


def blocks(
    along: FloatArray, values: FloatArray, number: int = BLOCKS
) -> tuple[FloatArray, FloatArray] | None:
    """Means of the strip's rows in blocks: place along the edge (B,), profile (B, D).

    Rows that leave the image take the nearest value inside; None if hardly any is inside.
    """
    inside = np.isfinite(values).mean(axis=1) > 0.5
    if inside.sum() < 4:
        return None
    along, values = along[inside], extended(values[inside])
    starts = np.linspace(0, len(along), min(number, len(along) // 2) + 1).astype(int)[:-1]
    size = np.diff(np.append(starts, len(along)))
    means = np.add.reduceat(values, starts, axis=0) / size[:, None]
    return np.add.reduceat(along, starts) / size, means


def extended(values: FloatArray) -> FloatArray:
    """Rows with their NaN replaced by the nearest finite value, shape (T, D)."""
    valid = np.isfinite(values)
    if valid.all():
        return values
    index = np.where(valid, np.arange(values.shape[1]), 0)
    before = np.maximum.accumulate(index, axis=1)
    # Where nothing finite lies before, the first finite value after.
    first = valid.argmax(axis=1)[:, None]
    rows = np.arange(len(values))[:, None]
    filled: FloatArray = values[rows, np.maximum(before, first)]
    return filled


def steepest(
    profiles: FloatArray, across: FloatArray, search: Search
) -> tuple[FloatArray, FloatArray]:
    """Place of the largest smoothed slope of each profile near 0, and that slope."""
    sigma = max(search.blur_extent / 6, 1.0)
    slope = ndimage.gaussian_filter1d(profiles, sigma, axis=1, order=1, mode="nearest")
    near = np.flatnonzero(np.abs(across) <= max(search.capture, 1.0))
    mean = slope.mean(axis=0)[near]
    slope *= copysign(1.0, mean[np.abs(mean).argmax()])
    top = near[slope[:, near].argmax(axis=1)]
    top = np.clip(top, 1, len(across) - 2)
    rows = np.arange(len(profiles))
    left, here, right = (slope[rows, top + i] for i in (-1, 0, 1))
    bend = left - 2 * here + right
    shift = np.where(bend < 0, 0.5 * (left - right) / np.minimum(bend, -1e-12), 0)
    return across[top] + np.clip(shift, -0.5, 0.5), np.maximum(here, 0)


def matched(profiles: FloatArray, reference: FloatArray) -> FloatArray:
    """Shift of each profile against a reference, pixels: ``P_b = a + b P - shift P'``.

    Level `a` and contrast `b` are free, so that uneven light is not taken for a shift.
    """
    design = np.stack([np.ones_like(reference), reference, -np.gradient(reference)], axis=1)
    solution: FloatArray = np.linalg.pinv(design.astype(np.float64)) @ profiles.T
    shift: FloatArray = solution[2] / np.maximum(solution[1], 0.2)
    return shift


def fit_line(along: FloatArray, shift: FloatArray, weight: FloatArray) -> tuple[float, float]:
    """Offset at 0 and slope of a line through (along, shift), robust to outliers.

    The median of all pairwise slopes (Theil and Sen), then least squares on what lies close.
    """
    if weight.sum() <= 0:
        return 0.0, 0.0
    i, j = np.triu_indices(len(along), k=max(1, len(along) // 4))
    slope = float(np.median((shift[j] - shift[i]) / (along[j] - along[i])))
    residual = shift - slope * along
    residual -= np.median(residual)
    close = np.abs(residual) <= max(1.0, 3 * float(np.median(np.abs(residual))))
    weight = weight * close
    if np.count_nonzero(weight) < 3:
        return float(np.median(shift - slope * along)), slope
    slope, offset = np.polyfit(along, shift, 1, w=np.sqrt(weight))
    return float(offset), float(slope)
