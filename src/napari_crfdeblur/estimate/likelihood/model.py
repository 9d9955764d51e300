"""What profiles are made of: a response, a shape for each group, two sides for each profile.

In linear light, channel `c` of edge `e` is ``l + w s(x + a)``: offset `l` and range `w` of its
own, the shape `s` of its group, and a small shift `a`, since edges do not lie just where they
were located, nor the channels of an edge just on each other. To first order in `a`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..._typing import FloatArray
from .evidence import EdgeGroup
from .family import Family

LEAST_RANGE = 1e-3  # of a profile in linear light, where the search starts


@dataclass(frozen=True, slots=True, eq=False)
class GroupState:
    """The unknowns of one group.

    Parameters
    ----------
    shape : ndarray, shape (M,)
        Edge spread `s` at the positions of the group.
    light : ndarray, shape (E, C, 2)
        Offset `l` and range `w` of each profile, in linear light.
    shift : ndarray, shape (E, C)
        How far each profile lies beside its place, pixels.

    Several states that are compared lie side by side: all arrays have one axis more, the first.
    """

    shape: FloatArray
    light: FloatArray
    shift: FloatArray

    def at(self, number: int) -> "GroupState":
        """One of several states side by side."""
        return GroupState(self.shape[number], self.light[number], self.shift[number])


@dataclass(frozen=True, slots=True, eq=False)
class ModelState:
    """All unknowns: coefficients of the response, shape (n,), and those of each group."""

    coefficients: FloatArray
    groups: tuple[GroupState, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """Linear light of the profiles of one group.

    Parameters
    ----------
    light : ndarray, shape (E, C, M + 2)
        Of each sample and of the two sides.
    spread : ndarray, shape (E, C, M + 2)
        Edge spread of each profile; 0 and 1 on its sides.
    slope : ndarray, shape (M + 2,)
        Change of the spread with the shift.
    """

    light: FloatArray
    spread: FloatArray
    slope: FloatArray


def predict(group: EdgeGroup, state: GroupState) -> Prediction:
    """Light of all profiles of a group, for one state or several side by side."""
    count = state.shape.shape[-1]
    slope, shape = np.zeros((2, *state.shape.shape[:-1], 1, 1, count + 2))
    slope[..., 0, 0, :count] = _slope(state.shape, group.step)
    shape[..., 0, 0, :count], shape[..., -1] = state.shape, 1.0
    spread = state.shift[..., np.newaxis] * slope
    spread += shape
    light = state.light[..., 1:] * spread
    light += state.light[..., :1]
    return Prediction(light, spread, slope[..., 0, 0, :])


def _slope(shape: FloatArray, step: float) -> FloatArray:
    """Slope of a shape along the last axis: of second order, but for its ends."""
    slope = np.empty_like(shape)
    slope[..., 1:-1] = shape[..., 2:] - shape[..., :-2]
    slope[..., 0] = 2 * (shape[..., 1] - shape[..., 0])
    slope[..., -1] = 2 * (shape[..., -1] - shape[..., -2])
    slope /= 2 * step
    return slope


def initial(groups: Sequence[EdgeGroup], family: Family) -> ModelState:
    """The unknowns as they follow from profiles and sides if the response were known."""
    return ModelState(family.coefficients, tuple(_initial(group, family) for group in groups))


def _initial(group: EdgeGroup, family: Family) -> GroupState:
    light = family.undo(group.intensity)
    offset = light[..., -2]
    change = light[..., -1] - offset
    change = np.where(change < 0, np.minimum(change, -LEAST_RANGE), np.maximum(change, LEAST_RANGE))
    rows = (light[..., :-2] - offset[..., np.newaxis]) / change[..., np.newaxis]
    weight = np.where(group.present, change**2, 0.0)
    shape = np.einsum("ec,ecm->m", weight, rows) / weight.sum()
    return GroupState(shape, np.stack([offset, change], axis=-1), np.zeros_like(offset))
