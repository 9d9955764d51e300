"""Photos of turned rectangles under an asymmetric blur, from a formula.

The PSF is a sum of round Gaussians along a bent path. Each blurs a rectangle into a product of
differences of the normal distribution, so every pixel is exact and every edge is known.
"""

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np
from scipy.special import ndtr

PATH = np.array([(-0.28, -0.12), (-0.1, 0.1), (0.06, 0.2), (0.2, 0.16)])  # extents, (row, col)
SHARE = np.array([0.4, 0.3, 0.2, 0.1])
SIGMA = 0.08  # extents


@dataclass(frozen=True)
class Rectangle:
    center: tuple[float, float]
    half: tuple[float, float]  # along and across `angle`
    angle: float
    light: tuple[float, ...]  # of the area, one for each channel

    @property
    def sides(self):
        """Middle, outward normal angle and length of the four sides."""
        for turn in range(4):
            angle = self.angle + turn * pi / 2
            out, along = self.half[turn % 2], 2 * self.half[1 - turn % 2]
            middle = np.array(self.center) + out * np.array([sin(angle), cos(angle)])
            yield middle, angle, along


def blurred_step(distance, angle, extent):
    """Share of the light from beyond an edge, at a distance along its normal."""
    offset = extent * PATH @ (sin(angle), cos(angle))
    return ndtr((np.asarray(distance)[..., None] - offset) / (SIGMA * extent)) @ SHARE


def blurred_cover(shape, rectangle, extent):
    """Share of each pixel's light that comes from the rectangle, shape (M, N)."""
    row, column = np.indices(shape)
    cover = np.zeros(shape)
    for (dy, dx), share in zip(extent * PATH, SHARE, strict=True):
        y, x = row - rectangle.center[0] - dy, column - rectangle.center[1] - dx
        s, c = sin(rectangle.angle), cos(rectangle.angle)
        sides = (x * c + y * s, x * s - y * c)
        pair = [
            ndtr((h - d) / (SIGMA * extent)) - ndtr((-h - d) / (SIGMA * extent))
            for d, h in zip(sides, rectangle.half, strict=True)
        ]
        cover += share * pair[0] * pair[1]
    return cover


def photograph(shape, ground, rectangles, extent, *, gamma=2.2, noise=0.0, seed=0):
    """Intensity in [0, 1], float64: (M, N) for one level of ground, else (M, N, 3)."""
    light = np.broadcast_to(np.array(ground, dtype=float), (*shape, len(ground))).copy()
    for rectangle in rectangles:
        cover = blurred_cover(shape, rectangle, extent)
        light += cover[..., None] * (np.array(rectangle.light) - ground)
    photo = light ** (1 / gamma)
    photo += noise * np.random.default_rng(seed).standard_normal(photo.shape)
    photo = np.clip(photo, 0, 1)
    return photo[..., 0] if len(ground) == 1 else photo


def crossing(inside, outside, angle, extent, gamma=2.2):
    """Distance along the outward normal at which intensity is midway between the sides."""
    d = np.linspace(-extent, extent, 20001)
    light = inside + (outside - inside) * blurred_step(d, angle, extent)
    level = (light ** (1 / gamma) - inside ** (1 / gamma)) / (
        outside ** (1 / gamma) - inside ** (1 / gamma)
    )
    return d[np.argmax(level >= 0.5)]


def to_kind(photo, dtype):
    """The photo in another kind of number."""
    if np.dtype(dtype).kind == "f":
        return photo.astype(dtype)
    return np.rint(photo * np.iinfo(dtype).max).astype(dtype)
