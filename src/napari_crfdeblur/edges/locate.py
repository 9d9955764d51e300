"""Where edges run, to a fraction of a pixel; many at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from .._typing import BoolArray, FloatArray
from .picture import Picture
from .strip import Frame, Strips, sample_strips

BLOCKS = 16  # pieces of an edge that are located on their own
LEAST_SHIFT = 1e-9  # of what is squared: rounding is less
TINY = 1e-60  # no square of a number that was recorded
PAIRS = np.triu_indices(BLOCKS, k=BLOCKS // 4)  # of pieces, far enough apart to tell a slope


@dataclass(frozen=True, slots=True)
class CaptureRange:
    """How far from a proposed line the edge may lie, and how wide it may be, in pixels."""

    capture: float
    blur_extent: float

    def reduced(self, step: int) -> "CaptureRange":
        """The same in a picture of which each pixel is `step` pixels wide."""
        return CaptureRange(self.capture / step, self.blur_extent / step)


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """Strips cut into pieces along the edge, each averaged.

    Parameters
    ----------
    along : ndarray, shape (K, B)
        Place of each piece, pixels from the middle of its edge.
    profiles : ndarray, shape (K, B, D)
        Its mean profile; where that leaves the image, the nearest value inside.
    inside : ndarray of bool, shape (K, B)
        Whether most of it lies in the image.
    """

    along: FloatArray
    profiles: FloatArray
    inside: BoolArray

    @property
    def mean(self) -> FloatArray:
        """Mean profile of each edge, shape (K, D)."""
        weight = self.inside / np.maximum(self.inside.sum(axis=1, keepdims=True), 1)
        mean: FloatArray = np.einsum("kb,kbd->kd", weight, self.profiles)
        return mean


def locate(picture: Picture, frames: Sequence[Frame], search: CaptureRange) -> list[Frame]:
    """The frames moved onto the edges next to them; left alone where there is no image.

    Every piece of the edge is found by the largest smoothed slope near the line. To be followed
    by :func:`refit`.
    """
    strips = sample_strips(picture, frames, search.capture + 0.75 * search.blur_extent + 2, 48)
    pieces = cut(strips)
    shift, weight = steepest(pieces, strips.across, search)
    return moved(frames, pieces, shift, weight)


def refit(picture: Picture, frames: Sequence[Frame], blur_extent: float) -> list[Frame]:
    """The frames turned and shifted by less than a blur, by least squares of their profiles."""
    pieces = cut(sample_strips(picture, frames, 0.75 * blur_extent + 4, 64))
    shift = matched(pieces.profiles, pieces.mean)
    # Beyond, the linearization says nothing.
    usable = (np.abs(shift) < 0.3 * blur_extent + 1) & pieces.inside
    return moved(frames, pieces, shift, usable.astype(float))


def moved(
    frames: Sequence[Frame], pieces: Pieces, shift: FloatArray, weight: FloatArray
) -> list[Frame]:
    """The frames on the lines through the shifts of their pieces."""
    lines = zip(*fit_lines(pieces.along, shift, weight, pieces.inside), strict=True)
    return [
        frame.moved(float(offset), float(slope))
        for frame, (offset, slope) in zip(frames, lines, strict=True)
    ]


def cut(strips: Strips) -> Pieces:
    """The strips in pieces; a piece is inside the image if half of its samples are."""
    k, _, d = strips.signal.shape
    means = strips.signal.reshape(k, BLOCKS, -1, d).mean(axis=2)
    along = strips.along.reshape(k, BLOCKS, -1).mean(axis=2)
    inside = np.isfinite(means).mean(axis=2) > 0.5
    return Pieces(along, np.where(inside[..., None], extended(means), 0), inside)


def extended(values: FloatArray) -> FloatArray:
    """Values with NaN replaced by the nearest finite one along the last axis."""
    valid = np.isfinite(values)
    if valid.all():
        return values
    index = np.where(valid, np.arange(values.shape[-1]), 0)
    before = np.maximum.accumulate(index, axis=-1)
    # Where nothing finite lies before, the first finite value after.
    first = valid.argmax(axis=-1)[..., None]
    filled: FloatArray = np.take_along_axis(values, np.maximum(before, first), axis=-1)
    return filled


def steepest(
    pieces: Pieces, across: FloatArray, search: CaptureRange
) -> tuple[FloatArray, FloatArray]:
    """Place of the largest smoothed slope of each piece near 0, and that slope, (K, B)."""
    sigma = max(search.blur_extent / 6, 1.0)
    slope = ndimage.gaussian_filter1d(pieces.profiles, sigma, axis=2, order=1, mode="nearest")
    near = np.abs(across) <= max(search.capture, 1.0)
    mean = slope.sum(axis=1)[:, near]
    top = np.abs(mean).argmax(axis=1)[:, None]
    slope *= np.copysign(1.0, np.take_along_axis(mean, top, axis=1))[:, None]
    first = int(near.argmax())
    place = first + slope[..., near].argmax(axis=2)
    place = np.clip(place, 1, len(across) - 2)[..., None]
    left, here, right = (np.take_along_axis(slope, place + i, axis=2)[..., 0] for i in (-1, 0, 1))
    bend = left - 2 * here + right
    shift = np.where(bend < 0, 0.5 * (left - right) / np.minimum(bend, -1e-12), 0)
    weight = np.maximum(here, 0) * pieces.inside
    return across[place[..., 0]] + np.clip(shift, -0.5, 0.5), weight


def matched(profiles: FloatArray, reference: FloatArray) -> FloatArray:
    """Shift of profiles (..., B, D) against a reference (..., D): ``P_b = a + b P - shift P'``.

    Level `a` and contrast `b` are free, so that uneven light is not taken for a shift.
    """
    reference = reference.astype(np.float64)
    slope = slopes(reference)
    # Without their means, which are the level: two unknowns remain.
    reference = reference - reference.mean(axis=-1, keepdims=True)
    slope = slope.mean(axis=-1, keepdims=True) - slope
    aa, ab, bb = (
        (x * y).sum(axis=-1, keepdims=True)
        for x, y in ((reference, reference), (reference, slope), (slope, slope))
    )
    # Of a flat reference any shift is right: the least one is taken.
    least = LEAST_SHIFT * (aa + bb) + TINY
    aa, bb = aa + least, bb + least
    a, b = ((profiles @ x[..., None])[..., 0] for x in (reference, slope))
    shift: FloatArray = (aa * b - ab * a) / np.maximum(bb * a - ab * b, 0.2 * (aa * bb - ab**2))
    return shift


def slopes(values: FloatArray) -> FloatArray:
    """Half the differences of the neighbors along the last axis, one-sided at its ends."""
    found = np.empty_like(values)
    found[..., 1:-1] = 0.5 * (values[..., 2:] - values[..., :-2])
    found[..., 0] = values[..., 1] - values[..., 0]
    found[..., -1] = values[..., -1] - values[..., -2]
    return found


def fit_lines(
    along: FloatArray, shift: FloatArray, weight: FloatArray, inside: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Offset at 0 and slope of lines through points (K, B), robust to outliers, (K,) each.

    The median of all pairwise slopes (Theil and Sen), then least squares on what lies close.
    """
    some = weight.sum(axis=1) > 0
    shift = np.where(inside, shift, np.nan)
    i, j = PAIRS
    slope = finite_median((shift[:, j] - shift[:, i]) / (along[:, j] - along[:, i]))
    residual = shift - slope[:, None] * along
    offset = finite_median(residual)
    residual -= offset[:, None]
    limit = np.maximum(1.0, 3 * finite_median(np.abs(residual)))
    weight = np.where(np.abs(residual) <= limit[:, None], weight, 0)
    enough = np.count_nonzero(weight, axis=1) >= 3
    total = np.where(enough, weight.sum(axis=1), 1)
    middle = (weight * along).sum(axis=1) / total
    lever = weight * (along - middle[:, None])
    spread = (lever * along).sum(axis=1)
    residual = np.where(weight > 0, residual, 0)
    change = (lever * residual).sum(axis=1) / np.where(spread > 0, spread, 1)
    lift = (weight * residual).sum(axis=1) / total - change * middle
    found = np.stack([offset + np.where(enough, lift, 0), slope + np.where(enough, change, 0)])
    offset, slope = np.where(some, np.nan_to_num(found), 0)
    return offset, slope


def finite_median(values: FloatArray) -> FloatArray:
    """Median of the finite values in each row, shape (K,); NaN where there are none."""
    ordered = np.sort(values, axis=1)  # NaN last
    count = np.isfinite(ordered).sum(axis=1, keepdims=True)
    last = values.shape[1] - 1
    low = np.take_along_axis(ordered, np.clip((count - 1) // 2, 0, last), axis=1)
    high = np.take_along_axis(ordered, np.clip(count // 2, 0, last), axis=1)
    found: FloatArray = ((low + high) / 2)[:, 0]
    return found
