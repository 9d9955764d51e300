"""How far the color channels of a photo lie beside each other, as its edges show it.

Lenses and raw conversion do not put red, green and blue exactly on each other. A channel that
is displaced by ``d`` shifts its profile across an edge of normal `n` by ``d . n``: what the
shifts of the channels of each edge have in common tells `d`.
"""

from dataclasses import replace

import numpy as np

from ..._typing import FloatArray, Image
from .evidence import EdgeGroup
from .problem import Problem, Shift
from .search import Found

FREE = 1.0  # standard deviation of a channel's place in pixels that hardly binds it


def misregistration(found: Found) -> FloatArray:
    """Displacement of each channel from their mean, in (row, column) pixels.

    Parameters
    ----------
    found : Found
        The most probable response, with the shift of each channel of each edge. They are found
        again, hardly bound, by one step of Gauss and Newton.

    Returns
    -------
    ndarray, shape (C, 2)
        0 for gray photos, and along a direction that no edge crosses.
    """
    groups = found.problem.groups
    count = 1 + max(source.channel for group in groups for source in group.group.sources)
    if count == 1:
        return np.zeros((1, 2))
    channels = [_channels(group) for group in groups]
    free = _freed(found.problem)
    state = free.normal(found.state).step(found.state, 0.0, 1.0)
    rows, values = [], []
    pairs = zip(free.groups, free.weights, state.groups, channels, strict=True)
    for group, weights, own, channel in pairs:
        weight = weights.sum(axis=-1) * own.light[..., 1] ** 2
        total = np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)
        angle = group.group.orientation
        of_channel = np.eye(count)[channel]
        # Only differences between the channels of an edge count: its own place does not.
        apart = of_channel - np.einsum("ec,eck->ek", weight / total, of_channel)[:, np.newaxis]
        shift = own.shift - (weight * own.shift).sum(axis=1, keepdims=True) / total
        normal = np.array([np.sin(angle), np.cos(angle)])
        root = np.sqrt(weight)
        rows.append(root[..., np.newaxis, np.newaxis] * apart[..., np.newaxis] * normal)
        # A profile that is displaced by x has the shape s(m - x).
        values.append(-root * shift)
    design = np.concatenate([row.reshape(-1, 2 * count) for row in rows])
    target = np.concatenate([value.ravel() for value in values])
    return np.asarray(np.linalg.lstsq(design, target, rcond=None)[0].reshape(count, 2))


def _freed(problem: Problem) -> Problem:
    return replace(problem, shift=Shift(problem.shift.edge, FREE))


def _channels(group: EdgeGroup) -> Image:
    """Color channel of each profile, shape (E, C); 0 where there is none."""
    sources = group.group.sources
    rows = {(photo, edge): row for row, (photo, edge) in enumerate(group.edges.tolist())}
    channels, filled = np.zeros(group.present.shape, dtype=np.int64), np.zeros(len(rows), int)
    for source in sources:
        row = rows[source.image, source.edge]
        channels[row, filled[row]] = source.channel
        filled[row] += 1
    return channels
