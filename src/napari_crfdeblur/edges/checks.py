"""Whether an edge is what the model predicts: a straight step, blurred, and nothing else."""

from math import sqrt

import numpy as np

from .._typing import BoolArray, FloatArray
from .base import EdgeStatus
from .locate import matched
from .strip import Strip
from .transition import Transition

LEAST_CONTRAST = 0.03  # 8 steps of 8 bit: below, rounding bends the profile
LEAST_LENGTH = 12.0  # pixels along an edge that are averaged
LEAST_RATIO = 0.8  # of length and width of an edge
SPARE = 2.0  # pixels: what sampling adds to the width of a transition
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
    apart = min(spread(profiles**gamma, sides**gamma) for gamma in TRIAL_GAMMAS)
    width = transition.last - transition.first
    if apart > max(0.75, SPLIT * width):
        return EdgeStatus.CHANNELS_DISAGREE
    return EdgeStatus.GOOD


def spread(profiles: FloatArray, sides: FloatArray) -> float:
    """Distance of the outermost crossings of profiles (D, C) with sides (2, C), samples."""
    places = [
        crossing(profile, start, end)
        for profile, start, end in zip(profiles.T, *sides, strict=True)
    ]
    return max(places) - min(places)


def crossing(profile: FloatArray, start: float, end: float) -> float:
    """Sample (with fraction) at which a profile first crosses the middle of its sides."""
    level = (profile - start) / (end - start) - 0.5
    i = max(int(np.argmax(level >= 0)), 1)
    step = level[i] - level[i - 1]
    return i - 1 + float(np.clip(-level[i - 1] / step, 0, 1)) if step > 0 else float(i)


def check_blocks(
    strip: Strip, transition: Transition
) -> tuple[FloatArray, list[EdgeStatus]] | None:
    """Place along the edge, and status, of each of its blocks; None if outside the image.

    Blocks are compared with the median profile: their flat sides, their place, and, once
    shifted there, their shape.
    """
    values = strip.values[..., transition.window]
    inside = np.isfinite(values).all(axis=(0, 2))
    along, values = strip.along[inside], values[:, inside]
    if len(along) < 4:
        return None
    # Blocks in which noise stays below 3 % of the contrast, if the edge is long enough.
    quiet = (transition.noise / (0.03 * max(transition.contrast, 1e-3))) ** 2
    length = max(4.0, 0.25 * (transition.last - transition.first), strip.spacing * quiet)
    number = int(np.clip(strip.spacing * len(along) / length, 4, 24))
    places, means = blocks(along, values, number)
    noise = 2.5 * transition.noise / np.sqrt(len(along) / len(places)) / transition.contrast
    return places, judge_blocks(means, transition, noise)


def blocks(along: FloatArray, values: FloatArray, number: int) -> tuple[FloatArray, FloatArray]:
    """Means of rows (C, T, D) in blocks: place along the edge (B,), profiles (B, D, C)."""
    starts = np.linspace(0, len(along), min(number, len(along) // 2) + 1).astype(int)[:-1]
    size = np.diff(np.append(starts, len(along)))
    means = np.add.reduceat(values, starts, axis=1) / size[:, None]
    return np.add.reduceat(along, starts) / size, np.moveaxis(means, 0, 2)


def judge_blocks(means: FloatArray, transition: Transition, noise: float) -> list[EdgeStatus]:
    """Status of each block's mean profiles, shape (B, D, C); noise in units of contrast."""
    weights, contrast = transition.weights, transition.contrast
    reference = np.median(means, axis=0)
    shift = matched(means @ weights, reference @ weights)
    residual = (means - reference) / contrast
    slope = np.gradient(reference, axis=0) / contrast
    unshifted = residual + shift[:, None, None] * slope
    flat = transition.flat + 1
    sides = np.maximum(worst_rms(residual[:, :flat]), worst_rms(residual[:, -flat:]))
    shape = worst_rms(unshifted[:, flat:-flat])
    width = transition.last - transition.first
    steep = max(float(np.abs(slope @ np.sign(weights)).max()), 1e-6)
    bent = np.abs(shift) > max(LEAST_BEND, ASTRAY * width) + noise / steep / np.sqrt(max(width, 1))
    uneven, varies = sides > UNLIKE + noise, shape > UNLIKE + noise
    conditions = [uneven, bent, varies]
    reasons = [EdgeStatus.UNEVEN_SIDE, EdgeStatus.CURVED, EdgeStatus.VARIES]
    return [
        next((r for r, bad in zip(reasons, row, strict=True) if bad), EdgeStatus.GOOD)
        for row in np.stack(conditions, axis=1)
    ]


def largest_bend(width: float) -> float:
    """Largest sagitta, pixels, that leaves a profile of this width as it is."""
    return max(LEAST_BEND, BEND * width)


def sagitta(strip: Strip, transition: Transition, first: float, last: float) -> float:
    """How far the part of an edge from `first` to `last` bends off its chord, pixels.

    A parabola through the shifts of its pieces against their mean profile, less twice the
    standard error that comes of the noise.
    """
    part = (strip.along >= first) & (strip.along <= last)
    signal = strip.signal[part, transition.window]
    inside = np.isfinite(signal).all(axis=1)
    if np.count_nonzero(inside) < LEAST_ROWS:
        return 0.0
    along, means = blocks(strip.along[part][inside], signal[None, inside], PIECES)
    mean = means[..., 0].mean(axis=0)
    shift = matched(means[..., 0], mean)
    t = (2 * along - first - last) / (last - first)
    solution = np.linalg.lstsq(np.stack([np.ones_like(t), t, t**2], axis=1), shift, rcond=None)[0]
    # Of the coefficient of t^2 over [-1, 1]: 45 / 4 times the variance of the mean shift.
    slope = np.gradient(mean)
    error = 2 * transition.noise * sqrt(45 / 4 / (np.count_nonzero(inside) * float(slope @ slope)))
    return max(abs(float(solution[2])) - error, 0.0)


def worst_rms(residual: FloatArray) -> FloatArray:
    """Root mean square over samples of (B, D, C), the worst of the channels, shape (B,)."""
    if residual.shape[1] == 0:
        return np.zeros(len(residual))
    rms: FloatArray = np.sqrt((residual**2).mean(axis=1)).max(axis=1)
    return rms
