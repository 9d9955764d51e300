"""Whether photos that were pooled are of one camera: each alone must lead to the same response."""

from collections.abc import Sequence
from itertools import combinations
from math import hypot

import numpy as np

from ..._typing import FloatArray
from ...profiles.base import ProfileGroup
from .posterior import SAMPLES, ResponsePosterior

# Difference of two curves, after alignment, that is no accident: in standard deviations of what
# is known of it, and in irradiance, below which it would not matter.
UNLIKELY = 2.5
MATTERS = 0.01


def by_photo(groups: Sequence[ProfileGroup]) -> list[list[ProfileGroup]]:
    """The groups of each photo."""
    photos = sorted({source.image for group in groups for source in group.sources})
    found = []
    for photo in photos:
        masks = [np.array([s.image == photo for s in g.sources], dtype=bool) for g in groups]
        pairs = zip(groups, masks, strict=True)
        found.append([group.select(mask) for group, mask in pairs if mask.any()])
    return found


def agreeing(known: Sequence[ResponsePosterior], covered: Sequence[tuple[float, float]]) -> bool:
    """Whether what each photo says alone is compatible with every other.

    Parameters
    ----------
    known : sequence of ResponsePosterior
        What each photo, or what was known before, says of the response.
    covered : sequence of (float, float)
        Range of intensity of which it speaks.
    """
    for one, other in combinations(range(len(known)), 2):
        low = max(covered[one][0], covered[other][0])
        high = min(covered[one][1], covered[other][1])
        if low >= high:
            continue
        apart = _difference(known[one], known[other], np.linspace(low, high, SAMPLES))
        expected = hypot(*(known[i].expected_error((low, high)) for i in (one, other)))
        if apart > max(UNLIKELY * expected, MATTERS):
            return False
    return True


def _difference(one: ResponsePosterior, other: ResponsePosterior, intensity: FloatArray) -> float:
    """Root mean square difference of the irradiance after the best affine alignment."""
    first, second = (p.prior.curve(p.coefficients).to_irradiance(intensity) for p in (one, other))
    aligned = np.linalg.qr(np.stack([np.ones_like(first), first], axis=1)).Q
    return float(np.sqrt(np.mean((second - aligned @ (aligned.T @ second)) ** 2)))
