"""Photos of straight bands under an asymmetric blur, from a formula, with their edges.

A band between two parallel lines: its two edges have opposite polarity and one orientation.
The PSF is a sum of round Gaussians along a bent path.
"""

from math import cos, sin

import numpy as np
from scipy.special import ndtr

from napari_crfdeblur.edges import Edge

PATH = np.array([(-0.28, -0.12), (-0.1, 0.1), (0.06, 0.2), (0.2, 0.16)])  # extents, (row, col)
SHARE = np.array([0.4, 0.3, 0.2, 0.1])
SIGMA = 0.08  # extents


def blurred_step(distance, angle, extent):
    """Share of the light from beyond an edge, at a distance along its normal."""
    offset = extent * PATH @ (sin(angle), cos(angle))
    return ndtr((np.asarray(distance)[..., None] - offset) / (SIGMA * extent)) @ SHARE


def middle_and_width(angle, extent):
    """Middle and width of the transition between its 1st and 99th percent."""
    d = np.linspace(-extent, extent, 8001)
    share = blurred_step(d, angle, extent)
    first, last = np.interp([0.01, 0.99], share, d)
    return (first + last) / 2, last - first


def band(shape, angle, half, levels, extent, *, gamma=1.0, noise=0.0, seed=0):
    """Photo (M, N, C) of a band of half-width `half`, and its two edges.

    `levels` holds the light before, within and after the band, shape (3, C).
    """
    row, column = np.indices(shape)
    center = (np.array(shape) - 1) / 2 + (0.2, -0.3)
    d = (row - center[0]) * sin(angle) + (column - center[1]) * cos(angle)
    levels = np.array(levels, dtype=float)
    light = levels[0] * np.ones((*shape, 1))
    for at, change in ((-half, levels[1] - levels[0]), (half, levels[2] - levels[1])):
        light = light + blurred_step(d - at, angle, extent)[..., None] * change
    photo = light ** (1 / gamma)
    photo += noise * np.random.default_rng(seed).standard_normal(photo.shape)
    length = 0.6 * min(shape)
    edges = []
    for at, change in ((-half, levels[1] - levels[0]), (half, levels[2] - levels[1])):
        middle, width = middle_and_width(angle, extent)
        edges.append(edge_at(center, angle, at + middle, length, width, change))
    return np.clip(photo, 0, 1), edges


def edge_at(center, angle, at, length, width, change):
    along = np.array([-cos(angle), sin(angle)]) * length / 2
    middle = center + at * np.array([sin(angle), cos(angle)])
    edge = Edge(tuple(middle - along), tuple(middle + along))
    change = change[np.abs(change).argmax()]
    same = np.dot(edge.normal, (sin(angle), cos(angle))) > 0
    return Edge(
        edge.start, edge.end, int(np.sign(change)) * (1 if same else -1), width, abs(change)
    )


def shares(group, gamma=1.0):
    """Profiles as shares of their range in linear light, shape (J, M)."""
    light, sides = group.intensity**gamma, group.sides**gamma
    return (light - sides[:, :1]) / (sides[:, 1:] - sides[:, :1])
