"""Whether an edge is what the model predicts: a straight step, blurred, and nothing else."""

from functools import cache
from math import sqrt

import numpy as np

from .._typing import BoolArray, FloatArray
from .base import EdgeStatus
from .locate import matched, slopes
from .strip import Strip
from .transition import Transition

LEAST_CONTRAST = 0.03  # 8 steps of 8 bit: below, rounding bends the profile
LEAST_LENGTH = 12.0  # pixels along an edge that are averaged
LEAST_RATIO = 0.8  # of length and width of an edge
SPARE = 2.0  # pixels: what sampling adds to the width of a transition
NOTHING = 1e-12  # contrast that is none: rounding
CLIP = 1.5 / 255  # distance from the ends of the range at which a pixel counts as clipped
CLIPPED_SHARE = 0.08  # of the pixels of a side
DRAWDOWN = 0.03  # largest fall of a rising profile, in units of its contrast
UNLIKE = 0.06  # largest rms deviation along the edge, in units of contrast
BEND = 0.05  # largest sagitta, in units of the width
ASTRAY = 0.06  # largest deviation of a block from the line, in units of the width
LEAST_BEND = 0.35  # pixels: a smaller deviation smears the profile less than the pixels do
SPLIT = 0.12  # largest displacement between channels, in units of the width
PIECES = 12  # of an edge, by which its bend is measured
LEAST_ROWS = 6  # of a strip, that show a bend
BLOCK_REASONS = (
    EdgeStatus.GOOD,
    EdgeStatus.UNEVEN_SIDE,
    EdgeStatus.CURVED,
    EdgeStatus.VARIES,
)  # in the order in which a block is checked
TRIAL_GAMMAS = (1.0, 1.6, 2.2, 3.0)  # rough inverse responses, linear to film-like


def shortest(width: float, step: int) -> float:
    """Shortest usable edge, in pixels `step` times those of the photo, as the width is.

    The ends of an edge feel what lies beyond them.
    """
    return max(LEAST_LENGTH / step, LEAST_RATIO * width)


def check_profile(strip: Strip, transition: Transition, blur_extent: float) -> EdgeStatus:
    """Checks of the mean profile across the edge."""
    averaged = transition.noise / np.sqrt(len(strip.along))
    if transition.contrast < max(LEAST_CONTRAST, 10 * averaged):
        return EdgeStatus.FAINT
    if clipped_channels(strip.values[..., transition.window], transition).all():
        return EdgeStatus.CLIPPED
    # Wider than the blur makes it: soft by itself, or with something beside it.
    if transition.last - transition.first > blur_extent + SPARE:
        return EdgeStatus.UNEVEN_SIDE
    relative = averaged / transition.contrast
    rising = transition.rising()
    if max(np.ptp(rising[s]) for s in (transition.before, transition.after)) > (
        0.06 + 6 * relative
    ):
        return EdgeStatus.UNEVEN_SIDE
    inside = rising[transition.first : transition.last + 1]
    if np.max(np.maximum.accumulate(inside) - inside) > DRAWDOWN + 5 * relative:
        return EdgeStatus.NOT_MONOTONE
    return EdgeStatus.GOOD


def clipped_channels(values: FloatArray, transition: Transition) -> BoolArray:
    """Channels with a side at the end of the range, shape (C,); `values` of its window."""
    flat = transition.flat + 1
    sides = [values[..., :flat], values[..., -flat:]]
    if not any(s.max() >= 1 - CLIP or s.min() <= CLIP for s in sides):
        return np.zeros(len(values), dtype=bool)
    share = [
        np.maximum((s >= 1 - CLIP).mean(axis=(1, 2)), (s <= CLIP).mean(axis=(1, 2))) for s in sides
    ]
    return np.asarray(np.maximum(*share) > CLIPPED_SHARE)


def check_channels(strip: Strip, transition: Transition) -> EdgeStatus:
    """Whether the channels cross their middle at the same place.

    An unknown response moves the crossings apart by itself, so they need to agree only under
    one of a few rough inverse responses.
    """
    usable = np.abs(transition.difference) >= max(0.2 * transition.contrast, LEAST_CONTRAST)
    usable &= ~clipped_channels(strip.values[..., transition.window], transition)
    if np.count_nonzero(usable) < 2:
        return EdgeStatus.GOOD
    profiles, sides = transition.profile[transition.window][:, usable], transition.sides[:, usable]
    gammas = np.array(TRIAL_GAMMAS)[:, None]
    places = crossings(np.maximum(profiles[:, None], 0) ** gammas, sides[:, None] ** gammas)
    width = transition.last - transition.first
    if np.ptp(places, axis=1).min() > max(0.75, SPLIT * width):
        return EdgeStatus.CHANNELS_DISAGREE
    return EdgeStatus.GOOD


def crossings(profiles: FloatArray, sides: FloatArray) -> FloatArray:
    """Samples (with fraction) at which profiles (D, ...) first cross the middle of their sides.

    The sides, shape (2, ...), differ.
    """
    level = (profiles - sides[0]) / (sides[1] - sides[0]) - 0.5
    i = np.maximum((level >= 0).argmax(axis=0), 1)[None]
    before, after = (np.take_along_axis(level, j, axis=0)[0] for j in (i - 1, i))
    step = after - before
    share = np.clip(-before / np.where(step > 0, step, 1), 0, 1)
    places: FloatArray = i[0] - 1 + np.where(step > 0, share, 1)
    return places


def check_blocks(
    strip: Strip, transition: Transition
) -> tuple[FloatArray, list[EdgeStatus]] | None:
    """Place along the edge, and status, of each of its blocks; None if outside the image.

    Blocks are compared with the median profile: their flat sides, their place, and, once
    shifted there, their shape.
    """
    inside = np.isfinite(strip.signal[:, transition.window]).all(axis=1)
    along, values = strip.along, strip.values[..., transition.window]
    if not inside.all():
        along, values = along[inside], values[:, inside]
    if len(along) < 4:
        return None
    # Blocks in which noise stays below 3 % of the contrast, if the edge is long enough.
    quiet = (transition.noise / (0.03 * max(transition.contrast, 1e-3))) ** 2
    length = max(4.0, 0.25 * (transition.last - transition.first), strip.spacing * quiet)
    number = int(np.clip(strip.spacing * len(along) / length, 4, 24))
    places, means = block_means(along, values, number)
    contrast = max(transition.contrast, NOTHING)
    noise = 2.5 * transition.noise / np.sqrt(len(along) / len(places)) / contrast
    return places, judge_blocks(means, transition, noise)


def block_means(
    along: FloatArray, values: FloatArray, number: int
) -> tuple[FloatArray, FloatArray]:
    """Means of rows (C, T, D) in blocks: place along the edge (B,), profiles (C, B, D)."""
    weights = averaging(len(along), min(number, len(along) // 2))
    return weights @ along, weights.astype(values.dtype) @ values


@cache
def averaging(rows: int, number: int) -> FloatArray:
    """Weights of rows in the means of blocks of nearly equal size, shape (B, T)."""
    block = (np.arange(rows) * number + number - 1) // rows
    members = block == np.arange(number)[:, None]
    return np.asarray(members / members.sum(axis=1, keepdims=True))


def judge_blocks(means: FloatArray, transition: Transition, noise: float) -> list[EdgeStatus]:
    """Status of each block's mean profiles, shape (C, B, D); noise in units of contrast."""
    weights, contrast = transition.weights, max(transition.contrast, NOTHING)
    reference = median_along(means, axis=1)
    shift = matched(colorless(means, weights), weights @ reference)
    residual = (means - reference[:, None]) / contrast
    slope = slopes(reference) / contrast
    unshifted = residual + shift[:, None].astype(means.dtype) * slope[:, None]
    flat = transition.flat + 1
    sides = np.maximum(worst_rms(residual[..., :flat]), worst_rms(residual[..., -flat:]))
    shape = worst_rms(unshifted[..., flat:-flat])
    width = transition.last - transition.first
    steep = max(float(np.abs(np.sign(weights) @ slope).max()), 1e-6)
    bent = np.abs(shift) > max(LEAST_BEND, ASTRAY * width) + noise / steep / np.sqrt(max(width, 1))
    uneven, varies = sides > UNLIKE + noise, shape > UNLIKE + noise
    first_bad = np.where(uneven, 1, np.where(bent, 2, np.where(varies, 3, 0)))
    return [BLOCK_REASONS[i] for i in first_bad.tolist()]


def colorless(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Values (C, B, D) along one color, shape (B, D)."""
    summed: FloatArray = weights @ values.reshape(len(values), -1)
    return summed.reshape(values.shape[1:])


def median_along(values: FloatArray, axis: int) -> FloatArray:
    """Median along an axis; faster than that of numpy, which looks for NaN."""
    ordered = np.sort(values, axis=axis)
    number = values.shape[axis]
    low, high = (ordered.take(i, axis=axis) for i in ((number - 1) // 2, number // 2))
    return np.asarray((low + high) / 2)


def largest_bend(width: float) -> float:
    """Largest sagitta, pixels, that leaves a profile of this width as it is."""
    return max(LEAST_BEND, BEND * width)


def sagitta(strip: Strip, transition: Transition, first: float, last: float) -> float:
    """How far the part of an edge from `first` to `last` bends off its chord, pixels.

    A parabola through the shifts of its pieces against their mean profile, less twice the
    standard error that comes of the noise.
    """
    part = slice(*np.searchsorted(strip.along, (first, last)))
    along, signal = strip.along[part], strip.signal[part, transition.window]
    inside = np.isfinite(signal).all(axis=1)
    rows = np.count_nonzero(inside)
    if rows < LEAST_ROWS:
        return 0.0
    if rows < len(along):
        along, signal = along[inside], signal[inside]
    along, (means,) = block_means(along, signal[None], PIECES)
    mean = means.mean(axis=0)
    shift = matched(means, mean)
    t = (2 * along - first - last) / (last - first)
    design = np.stack([np.ones_like(t), t, t**2])
    solution = np.linalg.solve(design @ design.T, design @ shift)
    # Of the coefficient of t^2 over [-1, 1]: 45 / 4 times the variance of the mean shift.
    slope = slopes(mean)
    steepness = max(float(slope @ slope), NOTHING**2)
    error = 2 * transition.noise * sqrt(45 / 4 / (rows * steepness))
    return max(abs(float(solution[2])) - error, 0.0)


def worst_rms(residual: FloatArray) -> FloatArray:
    """Root mean square over samples of (C, B, D), the worst of the channels, shape (B,)."""
    if residual.shape[2] == 0:
        return np.zeros(residual.shape[1])
    mean = np.einsum("cbd,cbd->cb", residual, residual) / residual.shape[2]
    rms: FloatArray = np.sqrt(mean.max(axis=0))
    return rms
