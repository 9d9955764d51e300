"""Edge profiles straight from the model, without a picture: to measure estimators by."""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import TypeAlias

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike
from scipy.special import roots_hermitenorm

from .. import arguments
from .._typing import FloatArray
from ..photo import to_unit
from ..profiles.base import ProfileGroup, ProfileSource
from .camera import Camera

DrawLevels: TypeAlias = Callable[[Generator, int], FloatArray]
"""Draws the irradiance of the two sides, dark then bright, of J profiles: shape (J, 2)."""

MOST_PIXELS = 1 << 26  # recorded for all profiles of a case: half a gigabyte
SMALLEST_RANGE = 0.2  # below it, an edge would not be picked


def any_levels(rng: Generator, rows: int) -> FloatArray:
    """Sides anywhere in [0, 1], at least 0.2 apart."""
    span = rng.uniform(SMALLEST_RANGE, 1, size=rows)
    dark = rng.uniform(0, 1 - span)
    return np.stack([dark, dark + span], axis=1)


def from_black(rng: Generator, rows: int) -> FloatArray:
    """All dark sides nearly black, .01: the response is determined up to a power."""
    return np.stack([np.full(rows, 0.01), rng.uniform(SMALLEST_RANGE, 1, size=rows)], axis=1)


def constant_contrast(rng: Generator, rows: int) -> FloatArray:
    """Bright sides four times their dark ones, as one edge seen in channels of unlike gain."""
    bright = rng.uniform(SMALLEST_RANGE / 0.75, 1, size=rows)
    return np.stack([bright / 4, bright], axis=1)


@dataclass(frozen=True, slots=True)
class ProfileCase:
    """A kind of profiles to draw at random.

    Parameters
    ----------
    groups : int
        Groups, each with its own blur and orientation.
    profiles : int
        Profiles in each group.
    samples : int
        Samples of each profile, 1 pixel apart.
    averaged : int
        Pixels averaged along the edge for each sample.
    levels : callable
        How the two sides are drawn, for example :func:`any_levels` or :func:`from_black`.
    falling : float
        Share of the profiles that fall from bright to dark.
    bad : float
        Share of the profiles whose shape is not that of their group: a soft edge, a
        neighboring edge or an uneven side.
    """

    groups: int = 1
    profiles: int = 8
    samples: int = 41
    averaged: int = 1
    levels: DrawLevels = any_levels
    falling: float = 0.0
    bad: float = 0.0

    def __post_init__(self) -> None:
        pixels = 1
        for name, least in (("groups", 1), ("profiles", 1), ("averaged", 1), ("samples", 8)):
            what = f"a number of {name}"
            pixels *= arguments.whole(getattr(self, name), what, least=least, most=MOST_PIXELS)
        if pixels > MOST_PIXELS:
            raise ValueError(f"expected at most {MOST_PIXELS} pixels in all profiles, got {pixels}")
        if not callable(self.levels):
            raise arguments.refusal("a function that draws levels", self.levels)
        arguments.number(self.falling, "a share that falls", least=0, most=1)
        arguments.number(self.bad, "a share that is bad", least=0, most=1)


def random_profiles(camera: Camera, case: ProfileCase, *, seed: int) -> list[ProfileGroup]:
    """Draw groups of profiles: ``f(l_j + w_j s(m) + n)`` with a random blur for each group.

    Parameters
    ----------
    camera : Camera
        Response, noise and rounding.
    case : ProfileCase
        How many profiles, and of what kind.
    seed : int
        The same seed gives the same profiles; cameras of other response or noise see the
        same edges and blurs.
    """
    arguments.instance(camera, Camera, "a Camera")
    arguments.instance(case, ProfileCase, "a ProfileCase")
    arguments.whole(seed, "a seed", least=0)
    seeds = np.random.SeedSequence(seed).spawn(case.groups)
    groups = []
    for number, child in enumerate(seeds):
        scene, exposure = (np.random.default_rng(s) for s in child.spawn(2))
        light, sides = _random_light(case, scene)
        angle = pi * number / case.groups
        groups.append(
            recorded(light, sides, camera, exposure, averaged=case.averaged, orientation=angle)
        )
    return groups


def recorded(
    light: ArrayLike,
    sides: ArrayLike,
    camera: Camera,
    rng: Generator,
    *,
    averaged: int = 1,
    orientation: float = 0.0,
) -> ProfileGroup:
    """Profiles as the camera records them, with their true variances.

    Parameters
    ----------
    light : array_like, shape (J, M)
        Irradiance of each profile, ``l_j + w_j s(m)``, 1 pixel apart.
    sides : array_like, shape (J, 2)
        Irradiance of the two homogeneous sides, ``l_j`` and ``l_j + w_j``.
    camera : Camera
        Response, noise and rounding.
    rng : numpy.random.Generator
        Source of the noise.
    averaged : int
        Pixels averaged along the edge for each sample; the sides average 8 times as many.
    orientation : float
        Angle of the normal, radians in [0, pi).
    """
    light, sides = np.asarray(light, dtype=float), np.asarray(sides, dtype=float)
    rows, samples = light.shape
    intensity, variance = _averaged(light, camera, rng, averaged)
    side_intensity, side_variance = _averaged(sides, camera, rng, 8 * averaged)
    signs = set(np.sign(sides[:, 1] - sides[:, 0]).astype(int).tolist())
    return ProfileGroup(
        position=np.arange(samples) - (samples - 1) / 2,
        intensity=intensity,
        variance=variance,
        count=np.full((rows, samples), float(averaged)),
        sides=side_intensity,
        sides_variance=side_variance,
        orientation=orientation,
        polarity=signs.pop() if len(signs) == 1 else 0,
        sources=tuple(ProfileSource(image=0, edge=j, channel=0) for j in range(rows)),
    )


def edge_shape(position: FloatArray, displacement: FloatArray) -> FloatArray:
    """Shape of a blurred edge, `s`: cumulated projection of the PSF on the edge's normal.

    ``s(m) = mean over t of clip(m - x(t) + 1/2, 0, 1)``: the share of a pixel at `m` that has
    passed the edge, averaged over the exposure.

    Parameters
    ----------
    position : ndarray, shape (M,)
        Where it is sampled, pixels.
    displacement : ndarray, shape (T,)
        `x(t)`, motion along the normal at equal times during the exposure, pixels.
    """
    passed = position[:, np.newaxis] - displacement + 0.5
    return np.asarray(np.clip(passed, 0, 1).mean(axis=1))


def random_displacement(rng: Generator, extent: float) -> FloatArray:
    """Shake of a hand projected on a line, shape (256,): pixels, `extent` from end to end."""
    velocity = np.zeros(256)
    for t, push in enumerate(rng.standard_normal(255), start=1):
        velocity[t] = 0.95 * velocity[t - 1] + push  # keeps its direction for about 20 steps
    path = np.cumsum(velocity)
    return np.asarray(((path - path.min()) / np.ptp(path) - 0.5) * extent)


def _random_light(case: ProfileCase, rng: Generator) -> tuple[FloatArray, FloatArray]:
    """Irradiance of the profiles of one group, shape (J, M), and of their sides, (J, 2)."""
    position = np.arange(case.samples) - (case.samples - 1) / 2
    displacement = random_displacement(rng, rng.uniform(0.5, 0.9) * (case.samples - 2))
    what = f"levels of two sides of {case.profiles} profiles"
    sides = arguments.array(case.levels(rng, case.profiles), what, axes=(2,), finite=True)
    if sides.shape != (case.profiles, 2):
        raise arguments.refusal(what, sides)
    falls = rng.permutation(case.profiles) < round(case.falling * case.profiles)
    sides = np.where(falls[:, np.newaxis], sides[:, ::-1], sides)
    shapes = np.tile(edge_shape(position, displacement), (case.profiles, 1))
    for row in rng.permutation(case.profiles)[: round(case.bad * case.profiles)]:
        spoil = FLAWS[rng.integers(len(FLAWS))]
        shapes[row] = spoil(rng, position, displacement)
    light = sides[:, :1] + np.diff(sides, axis=1) * shapes
    return np.clip(light, 0, 1), sides


def _soft(rng: Generator, position: FloatArray, displacement: FloatArray) -> FloatArray:
    """The edge itself is a ramp of 2 to 6 pixels, as at the limb of a rounded object."""
    ramp = np.linspace(-0.5, 0.5, 16) * rng.uniform(2, 6)
    return edge_shape(position, np.add.outer(displacement, ramp).ravel())


def _neighbor(rng: Generator, position: FloatArray, displacement: FloatArray) -> FloatArray:
    """A second edge reaches into the profile at one end."""
    end = rng.choice([-1, 1]) * rng.uniform(0.35, 0.6) * position.size
    step = rng.uniform(-0.3, 0.3)
    shape = edge_shape(position, displacement)
    return np.asarray(shape + step * (edge_shape(position - end, displacement) - (end < 0)))


def _uneven(rng: Generator, position: FloatArray, displacement: FloatArray) -> FloatArray:
    """One side gets steadily brighter or darker away from the edge."""
    side = np.maximum(rng.choice([-1, 1]) * position, 0) / position[-1]
    return np.asarray(edge_shape(position, displacement) + rng.uniform(-0.3, 0.3) * side)


FLAWS = (_soft, _neighbor, _uneven)


def _averaged(
    light: FloatArray, camera: Camera, rng: Generator, pixels: int
) -> tuple[FloatArray, FloatArray]:
    """Mean of several recorded pixels of the same light, and its variance."""
    recordings = to_unit(camera.expose(np.broadcast_to(light, (pixels, *light.shape)), rng))
    random = _intensity_variance(light, camera)
    rounding = camera.step**2 / 12
    kept = rounding * _kept_share(random, camera.step)
    return recordings.mean(axis=0), (random + rounding - kept) / pixels + kept


def _kept_share(variance: FloatArray, step: float) -> FloatArray:
    """Share of the rounding error that averaging does not remove.

    Noise dithers the rounding: of the sawtooth of its error, the k-th harmonic keeps
    ``exp(-2 (pi k sigma / step)^2)`` of its amplitude.
    """
    if step == 0:
        return np.zeros_like(variance)
    k = np.arange(1, 30)
    left = np.exp(-((2 * pi * k / step) ** 2) * variance[..., np.newaxis]) / k**2
    return np.asarray(left.sum(axis=-1) / (1 / k**2).sum())


def _intensity_variance(light: FloatArray, camera: Camera) -> FloatArray:
    """Variance of ``f(E + n)``, by Gauss-Hermite quadrature over the noise."""
    nodes, weights = roots_hermitenorm(21)
    deviation = np.sqrt(camera.noise_variance(light))
    values = camera.response.to_intensity(
        light[..., np.newaxis] + deviation[..., np.newaxis] * nodes
    )
    weights = weights / weights.sum()
    mean = values @ weights
    return np.asarray((values - mean[..., np.newaxis]) ** 2 @ weights)
