"""How well profiles could tell a response at best: the bound of Cramer and Rao, and van Trees'.

For profiles straight from the model all is known: light, noise, rounding. Near the true response
the camera's is ``f(E) + sum_i c_i d_i(E)`` with the directions of a prior, and the profiles of a
group have an unknown shape `s`, each an unknown offset `l` and range `w`. With the derivatives
`H` of what is recorded, its covariance `C` and all other unknowns eliminated, no estimate of `c`
without bias varies less than ``(H' C^-1 H)^-1``, and none that knows the prior, on the average
over its cameras, less than ``(H' C^-1 H + 1)^-1``. What this means for the inverse response is
drawn from normal distributions of these covariances, in the measure of ``response_error``.

The bound takes all errors for normal. Rounding is not, which could be exploited; and a response
beside the family costs what its nearest member lacks, the floor, whatever the profiles.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import roots_hermitenorm

from napari_crfdeblur.profiles import ProfileGroup
from napari_crfdeblur.quality import STEPS, response_error
from napari_crfdeblur.response import Identity, ResponseCurve, ResponsePrior
from napari_crfdeblur.response.prior import NODES
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles

Floats = NDArray[np.floating]
Pair = tuple[float, float]
DRAWS = 64  # curves about the truth
HARMONICS = np.arange(1, 30)  # of the sawtooth that rounding adds
ALIKE = 0.2  # of a step: less, and two samples are rounded alike
LEAST_ALONE = 1e-3  # of the variance of rounding, so that covariances have an inverse
# Information on a shape, an offset or a range before any profile: all of them are of order 1.
WEAK = 1.0
# Slope of the true response below which its inverse is no longer linear in a change of `f`.
LEAST_GAIN = 0.02
FITS = 12  # steps to the nearest member of a family


@dataclass(frozen=True, slots=True)
class Bound:
    """Least errors to expect of one case, in the measure of ``response_error``.

    Parameters
    ----------
    alone : float
        Of an estimate without bias that knows only the profiles.
    prior : float
        Of an estimate that knows the prior, too.
    floor : float
        Of the member of the family that is nearest to the true response.
    """

    alone: float
    prior: float
    floor: float


@dataclass(frozen=True, slots=True, eq=False)
class TrueProfiles:
    """What is behind the profiles of a group.

    Parameters
    ----------
    light : ndarray, shape (J, M + 2)
        Irradiance of the samples, then of the two sides.
    shape : ndarray, shape (M,)
        `s`, common to the group.
    covariance : ndarray, shape (J, M + 2, M + 2)
        Of what is recorded, in intensity.
    """

    light: Floats
    shape: Floats
    covariance: Floats


def bound(
    camera: Camera, case: ProfileCase, prior: ResponsePrior, covered: Pair, *, seed: int
) -> Bound:
    """Least errors to expect of the profiles that ``random_profiles`` draws for a seed.

    Profiles whose shape is not that of their group tell nothing here.
    """
    truth = camera.response
    profiles = true_profiles(camera, case, seed)
    told = sum(information(own, camera, prior) for own in profiles)
    return Bound(
        alone=straight_error(told, truth, prior, covered),
        prior=drawn_error(np.linalg.inv(told + np.eye(prior.size)), truth, prior, covered),
        floor=floor(truth, prior, covered),
    )


def true_profiles(camera: Camera, case: ProfileCase, seed: int) -> list[TrueProfiles]:
    """Light and covariance of the good profiles that ``random_profiles`` draws for a seed."""
    exact = Camera(Identity(), bits=None)
    drawn = random_profiles(exact, case, seed=seed)
    intended = random_profiles(exact, replace(case, bad=0.0), seed=seed)
    unrounded = random_profiles(replace(camera, bits=None), case, seed=seed)
    found = []
    for group, good, noisy in zip(drawn, intended, unrounded, strict=True):
        kept = np.all(group.intensity == good.intensity, axis=1)
        light = np.concatenate([group.intensity, group.sides], axis=1)[kept]
        variance = np.concatenate([noisy.variance, noisy.sides_variance], axis=1)[kept]
        found.append(
            TrueProfiles(
                light, shape(group, kept), covariance(light, variance, camera, case.averaged)
            )
        )
    return found


def shape(group: ProfileGroup, kept: NDArray[np.bool_]) -> Floats:
    """Common shape of the light of some profiles."""
    low, high = group.sides[kept].T
    rows = (group.intensity[kept] - low[:, np.newaxis]) / (high - low)[:, np.newaxis]
    return np.average(rows, axis=0, weights=(high - low) ** 2)


def covariance(light: Floats, variance: Floats, camera: Camera, averaged: int) -> Floats:
    """Covariance of the samples of each profile, shape (J, M + 2, M + 2): noise and rounding.

    Samples of nearly the same light are rounded alike, as far as no noise dithers them: what
    the `k`-th harmonic of the error keeps then is ``exp(-2 (pi k sigma / step)^2)``. Beyond a
    fifth of a step, what two roundings have in common depends on the unknowns too much to be
    known.
    """
    own = np.eye(light.shape[1])
    if camera.step == 0:
        return variance[..., np.newaxis] * own
    pixels = averaged * np.append(np.ones(light.shape[1] - 2), [8.0, 8.0])
    random, rounding = variance * pixels, camera.step**2 / 12
    left = np.exp(-((2 * np.pi * HARMONICS / camera.step) ** 2) * random[..., np.newaxis])
    kept = (left / HARMONICS**2).sum(axis=-1) / (1 / HARMONICS**2).sum()
    intensity = camera.response.to_intensity(light)
    apart = np.abs(intensity[:, :, np.newaxis] - intensity[:, np.newaxis]) / camera.step
    alike = np.where(apart < ALIKE, 1 - 6 * apart * (1 - apart), 0)
    common = np.sqrt(kept[:, :, np.newaxis] * kept[:, np.newaxis]) * alike
    alone = (random + rounding * (1 - kept)) / pixels + LEAST_ALONE * rounding
    return rounding * common + alone[..., np.newaxis] * own


def information(profiles: TrueProfiles, camera: Camera, prior: ResponsePrior) -> Floats:
    """Fisher's information on the coefficients of the response, shape (n, n), of one group."""
    gain, sensitivity = derivatives(profiles.light, camera, prior)
    rows, count = len(profiles.light), profiles.shape.size
    size, others = prior.size, count + 2 * rows
    spread = np.append(profiles.shape, [0.0, 1.0])
    full = np.zeros((size + others, size + others))
    for row in range(rows):
        slope = np.zeros((count + 2, size + others))
        slope[:, :size] = sensitivity[row]
        contrast = profiles.light[row, -1] - profiles.light[row, -2]
        slope[range(count), range(size, size + count)] = gain[row, :count] * contrast
        own = size + count + 2 * row
        slope[:, own], slope[:, own + 1] = gain[row], gain[row] * spread
        full += slope.T @ np.linalg.solve(profiles.covariance[row], slope)
    mixed = full[:size, size:]
    rest = full[size:, size:] + WEAK * np.eye(others)
    return full[:size, :size] - mixed @ np.linalg.solve(rest, mixed.T)


def derivatives(light: Floats, camera: Camera, prior: ResponsePrior) -> tuple[Floats, Floats]:
    """Change of the mean recorded intensity with the light and with each coefficient.

    The noise enters before the response: both are means over it.
    """
    nodes, weights = roots_hermitenorm(15)
    deviation = np.sqrt(camera.noise_variance(light))[..., np.newaxis]
    seen = light[..., np.newaxis] + deviation * nodes
    inside = (seen >= 0) & (seen <= 1)
    weights = weights / weights.sum()
    gain = (camera.response.slope(seen) * inside) @ weights
    rows = [np.interp(seen, NODES, direction) @ weights for direction in prior.directions]
    return gain, np.stack(rows, axis=-1)


def irradiance_map(truth: ResponseCurve, prior: ResponsePrior, covered: Pair) -> Floats:
    """Change of the inverse response with each coefficient after alignment, shape (N, n)."""
    light = truth.to_irradiance(np.linspace(*covered, STEPS))
    change = np.stack([np.interp(light, NODES, d) for d in prior.directions], axis=1)
    change = -change / np.maximum(truth.slope(light), LEAST_GAIN)[:, np.newaxis]
    affine = np.linalg.qr(np.stack([np.ones(STEPS), light], axis=1)).Q
    return change - affine @ (affine.T @ change)


def straight_error(
    told: Floats, truth: ResponseCurve, prior: ResponsePrior, covered: Pair
) -> float:
    """Mean error to first order; infinite where the profiles leave a direction open."""
    sizes, axes = np.linalg.eigh(told)
    if sizes[0] <= 1e-12 * sizes[-1]:
        return float("inf")
    normal = np.random.default_rng(0).standard_normal((DRAWS, prior.size))
    errors = (normal / np.sqrt(sizes)) @ axes.T @ irradiance_map(truth, prior, covered).T
    return float(np.sqrt(np.mean(errors**2, axis=1)).mean())


def drawn_error(spread: Floats, truth: ResponseCurve, prior: ResponsePrior, covered: Pair) -> float:
    """Mean error of responses drawn about the true one."""
    sizes, axes = np.linalg.eigh(spread)
    normal = np.random.default_rng(0).standard_normal((DRAWS, prior.size))
    about = ResponsePrior(truth.to_intensity(NODES), prior.directions)
    draws = (normal * np.sqrt(np.maximum(sizes, 0))) @ axes.T
    return float(np.mean([response_error(about.curve(c), truth, covered) for c in draws]))


def floor(truth: ResponseCurve, prior: ResponsePrior, covered: Pair) -> float:
    """Error of the nearest member of the family, by Gauss-Newton steps from the projection."""
    samples = truth.to_intensity(NODES) - prior.mean
    best, *_ = np.linalg.lstsq(prior.directions.T, samples, rcond=None)
    least = response_error(prior.curve(best), truth, covered)
    step = 1.0
    for _ in range(FITS):
        curve = prior.curve(best)
        change = irradiance_map(curve, prior, covered)
        missing = _missing(curve, truth, covered)
        move, *_ = np.linalg.lstsq(change, missing, rcond=1e-9)
        error = response_error(prior.curve(best + step * move), truth, covered)
        if error < least:
            best, least = best + step * move, error
        else:
            step /= 2
    return least


def _missing(curve: ResponseCurve, truth: ResponseCurve, covered: Pair) -> Floats:
    """What the inverse of a curve lacks of the true one, but for an affine change."""
    intensity = np.linspace(*covered, STEPS)
    light, target = curve.to_irradiance(intensity), truth.to_irradiance(intensity)
    affine = np.linalg.qr(np.stack([np.ones(STEPS), light], axis=1)).Q
    return target - affine @ (affine.T @ target)
