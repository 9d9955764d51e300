"""Whether an edge is what the model predicts: a straight step, blurred, and nothing else."""

import numpy as np

from .._typing import BoolArray, FloatArray
from .base import EdgeStatus
from .locate import blocks, matched
from .strip import Strip
from .transition import Transition

LEAST_CONTRAST = 0.03  # 8 steps of 8 bit: below, rounding bends the profile
LEAST_LENGTH = 12.0  # pixels along an edge that are averaged
CLIP = 1.5 / 255  # distance from the ends of the range at which a pixel counts as clipped
CLIPPED_SHARE = 0.08  # of the pixels of a side
DRAWDOWN = 0.03  # largest fall of a rising profile, in units of its contrast
UNLIKE = 0.06  # largest rms deviation along the edge, in units of contrast
BEND = 0.06  # largest deviation from a line, in units of the width
SPLIT = 0.12  # largest displacement between channels, in units of the width
TRIAL_GAMMAS = (1.0, 1.6, 2.2, 3.0)  # rough inverse responses, linear to film-like


def shortest(width: float) -> float:
    """Shortest usable edge, pixels: its ends feel what lies beyond them."""
    return max(LEAST_LENGTH, 0.6 * width)


def check_profile(strip: Strip, transition: Transition) -> EdgeStatus:
    """Checks of the mean profile across the edge."""
    averaged = transition.noise / np.sqrt(len(strip.along))
    if transition.contrast < max(LEAST_CONTRAST, 10 * averaged):
        return EdgeStatus.FAINT
    if clipped_channels(strip.values[:, transition.window], transition).all():
        return EdgeStatus.CLIPPED
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
    sides = [values[:, :flat], values[:, -flat:]]
    share = [
        np.maximum((s >= 1 - CLIP).mean(axis=(0, 1)), (s <= CLIP).mean(axis=(0, 1))) for s in sides
    ]
    return np.asarray(np.maximum(*share) > CLIPPED_SHARE)


def check_channels(strip: Strip, transition: Transition) -> EdgeStatus:
    """Whether the channels cross their middle at the same place.

    An unknown response moves the crossings apart by itself, so they need to agree only under
    one of a few rough inverse responses.
    """
    usable = np.abs(transition.difference) >= max(0.2 * transition.contrast, LEAST_CONTRAST)
    usable &= ~clipped_channels(strip.values[:, transition.window], transition)
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
    values = strip.values[:, transition.window]
    inside = np.isfinite(values).all(axis=(1, 2))
    along, values = strip.along[inside], values[inside]
    # Blocks in which noise stays below 3 % of the contrast, if the edge is long enough.
    quiet = (transition.noise / (0.03 * max(transition.contrast, 1e-3))) ** 2
    length = max(4.0, 0.25 * (transition.last - transition.first), strip.spacing * quiet)
    number = int(np.clip(strip.spacing * len(along) / length, 4, 24))
    found = blocks(along, values.reshape(len(values), -1), number)
    if found is None:
        return None
    places, means = found
    means = means.reshape(len(places), -1, values.shape[2])
    noise = 2.5 * transition.noise / np.sqrt(len(along) / len(places)) / transition.contrast
    return places, judge_blocks(means, transition, noise)


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
    bent = np.abs(shift) > max(0.35, BEND * width) + noise / steep / np.sqrt(max(width, 1))
    uneven, varies = sides > UNLIKE + noise, shape > UNLIKE + noise
    conditions = [uneven, bent, varies]
    reasons = [EdgeStatus.UNEVEN_SIDE, EdgeStatus.CURVED, EdgeStatus.VARIES]
    return [
        next((r for r, bad in zip(reasons, row, strict=True) if bad), EdgeStatus.GOOD)
        for row in np.stack(conditions, axis=1)
    ]


def worst_rms(residual: FloatArray) -> FloatArray:
    """Root mean square over samples of (B, D, C), the worst of the channels, shape (B,)."""
    if residual.shape[1] == 0:
        return np.zeros(len(residual))
    rms: FloatArray = np.sqrt((residual**2).mean(axis=1)).max(axis=1)
    return rms
