"""How far the color channels of a photo lie beside each other, as its edges show it.

Lenses and raw conversion do not put red, green and blue exactly on each other. A channel that
is displaced by ``d`` shifts its profile across an edge of normal `n` by ``d . n``: what the
shifts of the channels of each edge have in common tells `d`.
"""

from dataclasses import replace

import numpy as np

from ..._typing import FloatArray, Image
from .evidence import EdgeGroup
from .model import GroupState
from .problem import Shift
from .search import Solution

FREE = 1.0  # standard deviation of a channel's place in pixels that hardly binds it


def misregistration(found: Solution) -> FloatArray:
    """Displacement of each channel from their mean, in (row, column) pixels.

    Parameters
    ----------
    found : Solution
        The most probable response, with the shift of each channel of each edge. They are found
        again, hardly bound, by one step of Gauss and Newton.

    Returns
    -------
    ndarray, shape (C, 2)
        0 for gray photos, and along a direction that no edge crosses.
    """
    groups = found.problem.groups
    seen = {source.channel for group in groups for source in group.group.sources}
    count = 1 + max(seen)
    if len(seen) == 1:
        return np.zeros((count, 2))
    free = replace(found.problem, shift=Shift(found.problem.shift.edge, FREE))
    state = free.normal(found.state).step(found.state, 0.0, 1.0)
    triples = zip(free.groups, free.weights, state.groups, strict=True)
    designs, targets = zip(*(_equations(*triple, count) for triple in triples), strict=True)
    solved = np.linalg.lstsq(np.concatenate(designs), np.concatenate(targets), rcond=None)[0]
    return np.asarray(solved.reshape(count, 2))


def _equations(
    group: EdgeGroup, weights: FloatArray, own: GroupState, count: int
) -> tuple[FloatArray, FloatArray]:
    """What the shifts of one group say of the displacements: matrix (E C, 2 count), and values.

    Only differences between the channels of an edge count: its own place does not.
    """
    weight = weights.sum(axis=-1) * own.light[..., 1] ** 2
    share = weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)
    of_channel = np.eye(count)[_channels(group)]
    apart = of_channel - np.einsum("ec,eck->ek", share, of_channel)[:, np.newaxis]
    shift = own.shift - (share * own.shift).sum(axis=1, keepdims=True)
    angle, root = group.group.orientation, np.sqrt(weight)
    normal = np.array([np.sin(angle), np.cos(angle)])
    design = root[..., np.newaxis, np.newaxis] * apart[..., np.newaxis] * normal
    # A profile that is displaced by x has the shape s(m - x).
    return design.reshape(-1, 2 * count), -(root * shift).ravel()


def _channels(group: EdgeGroup) -> Image:
    """Color channel of each profile, shape (E, C); 0 where there is none."""
    rows = {(photo, edge): row for row, (photo, edge) in enumerate(group.edges.tolist())}
    channels, filled = np.zeros(group.present.shape, dtype=np.int64), np.zeros(len(rows), int)
    for source in group.group.sources:
        row = rows[source.image, source.edge]
        channels[row, filled[row]] = source.channel
        filled[row] += 1
    return channels
