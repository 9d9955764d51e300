"""Shapes that a known PSF gives to the profiles of each orientation."""

from collections.abc import Sequence

import numpy as np

from ..._typing import FloatArray
from ...psf.projection import project
from .evidence import EdgeGroup
from .model import GroupState, ModelState
from .problem import Expected

# Precision of a shape that is known: to a thousandth of the contrast, that of a rounded PSF.
KNOWN = 1e6
SEARCHED = np.linspace(-1.0, 1.0, 81)  # places of the origin, in half-widths of the profiles


def expected_shapes(
    psf: FloatArray, groups: Sequence[EdgeGroup], state: ModelState
) -> tuple[Expected, ...]:
    """Edge spread of each group, its origin where it meets the shapes found so far best.

    Profiles are aligned by a shape that the response distorts; the edges' own shifts do the rest.
    """
    pairs = zip(groups, state.groups, strict=True)
    return tuple(_expected(psf, group, _typical_shape(group, own)) for group, own in pairs)


def _typical_shape(group: EdgeGroup, own: GroupState) -> FloatArray:
    """The shape of a group where its profiles lie on the average, by their ranges."""
    weight = np.where(group.present, own.light[..., 1] ** 2, 0.0)
    shift = float((weight * own.shift).sum() / weight.sum())
    return np.asarray(own.shape + shift * np.gradient(own.shape, group.step))


def _expected(psf: FloatArray, group: EdgeGroup, shape: FloatArray) -> Expected:
    places = SEARCHED * group.position[-1]
    step = places[1] - places[0]
    for _ in range(2):  # to a fortieth of a half-width, then to a four-hundredth
        spreads = project(psf, group.group.orientation, group.position + places[:, np.newaxis])
        best = int(np.argmin(((spreads - shape) ** 2).sum(axis=1)))
        found = Expected(spreads[best], KNOWN)
        places = places[best] + np.linspace(-step, step, 21)
    return found
