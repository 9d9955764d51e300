"""What is known of a camera's response before any photo: a mean curve and how others differ."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments
from .._typing import FloatArray
from .base import ResponseCurve
from .basis import LARGEST, emor_table
from .parametric import SRGB
from .tabulated import Tabulated, monotone

# Irradiance at which responses are sampled: denser towards 0, where they bend most.
NODES = np.linspace(0.0, 1.0, 513) ** 2
NODES.setflags(write=False)
# Standard deviations of the first EMoR coefficients over the 201 responses of DoRF.
DORF_DEVIATIONS = (3.42, 1.29, 0.47, 0.20, 0.096, 0.071, 0.052, 0.037, 0.037, 0.030, 0.019, 0.014)
DIRECTIONS = 12  # of a prior made of many curves: what is left of those of DoRF is below .001


@dataclass(frozen=True, slots=True, eq=False)
class ResponsePrior:
    """A family of responses: ``f(E) = f_0(E) + sum_i c_i d_i(E)``, `c` standard normal.

    Curves of the family that are not strictly increasing do not count; a posterior of one
    estimate is the prior of the next.

    Parameters
    ----------
    mean : ndarray, shape (513,)
        `f_0`, intensity at irradiance ``(k / 512)^2``, strictly increasing from 0 to 1.
    directions : ndarray, shape (n, 513)
        `d_i`, each as large as one standard deviation; 0 at both ends.
    """

    mean: FloatArray
    directions: FloatArray

    def __post_init__(self) -> None:
        for name in ("mean", "directions"):
            values = arguments.kept(getattr(self, name), name)
            object.__setattr__(self, name, values)
            if values.shape[-1:] != NODES.shape:
                raise ValueError(
                    f"expected finite {name} at {NODES.size} values of irradiance, "
                    f"got shape {values.shape}"
                )
        if self.mean.ndim != 1 or self.directions.ndim != 2 or len(self.directions) == 0:
            raise ValueError("expected one mean curve, and directions of shape (n, 513)")
        if self.mean[0] != 0 or self.mean[-1] != 1 or np.any(np.diff(self.mean) <= 0):
            raise ValueError("expected a mean response that increases strictly from 0 to 1")
        if np.any(self.directions[:, [0, -1]]):
            raise ValueError("expected directions that leave both ends where they are")

    @classmethod
    def from_curves(
        cls, curves: Sequence[ResponseCurve], directions: int = DIRECTIONS
    ) -> "ResponsePrior":
        """The normal distribution with the mean and the main directions of some responses.

        Parameters
        ----------
        curves : sequence of ResponseCurve
            At least 2.
        directions : int
            Principal components that are kept.
        """
        arguments.instances(curves, ResponseCurve, "response curves")
        arguments.whole(directions, "a number of directions", least=1)
        if len(curves) < 2:
            raise ValueError(f"expected at least 2 curves, got {len(curves)}")
        samples = np.array([curve.to_intensity(NODES) for curve in curves])
        mean = samples.mean(axis=0)
        _, sizes, shapes = np.linalg.svd(samples - mean, full_matrices=False)
        spread = sizes[:, np.newaxis] / np.sqrt(len(samples) - 1) * shapes
        return cls(_strict(mean).intensity, pinned(spread[:directions]))

    @property
    def size(self) -> int:
        """Number of directions."""
        return len(self.directions)

    def curve(self, coefficients: ArrayLike = ()) -> Tabulated:
        """A response of the family, made strictly increasing where it is not.

        Parameters
        ----------
        coefficients : array_like, shape (n,), or ()
            `c` in standard deviations; none for the mean.
        """
        weights = np.asarray(coefficients, dtype=np.float64)
        samples = self.mean + weights @ self.directions if weights.size else self.mean
        return _strict(samples)

    def deviation(self, irradiance: ArrayLike) -> FloatArray:
        """Standard deviation of the intensity at the given irradiance."""
        spread = np.sqrt(np.square(self.directions).sum(axis=0))
        return np.asarray(np.interp(np.clip(irradiance, 0, 1), NODES, spread))

    def narrowed(self, coefficients: FloatArray, covariance: FloatArray) -> "ResponsePrior":
        """The family after an estimate: its mean at `coefficients`, spread by `covariance`.

        Parameters
        ----------
        coefficients : ndarray, shape (n,)
        covariance : ndarray, shape (n, n)
            Positive semi-definite.
        """
        values, vectors = np.linalg.eigh(covariance)
        roots = (vectors * np.sqrt(np.maximum(values, 0))).T
        # The same normal distribution, by its main directions.
        _, sizes, shapes = np.linalg.svd(roots @ self.directions, full_matrices=False)
        return ResponsePrior(self.curve(coefficients).intensity, pinned(sizes[:, None] * shapes))


def _strict(samples: FloatArray) -> Tabulated:
    """The response through samples at the nodes, made strictly increasing."""
    return Tabulated(NODES, monotone(NODES, samples).irradiance)


def pinned(directions: FloatArray) -> FloatArray:
    """Directions with both ends set to exactly 0: rounding can leave a trace there."""
    fixed = np.array(directions)
    fixed[:, [0, -1]] = 0.0
    return fixed


def _emor_directions(deviations: Sequence[float]) -> FloatArray:
    """EMoR curves, each as large as its deviation, at the nodes."""
    steps = np.linspace(0.0, 1.0, emor_table().shape[1])
    rows = zip(deviations, emor_table()[1:], strict=False)
    return pinned(np.array([d * np.interp(NODES, steps, h) for d, h in rows]))


@cache
def film_and_digital() -> ResponsePrior:
    """The 201 responses of DoRF, most of them of film (Grossberg & Nayar, TPAMI 2004)."""
    steps = np.linspace(0.0, 1.0, emor_table().shape[1])
    mean = _strict(np.interp(NODES, steps, emor_table()[0])).intensity
    return ResponsePrior(mean, _emor_directions(DORF_DEVIATIONS))


# Digital cameras as they are built: the sRGB curve of light that passed a shoulder, then a tone
# curve of more or less contrast. Figures of that kind, not fitted to any set of cameras.
SHOULDER = (0.4, 0.5)  # mean and deviation of log k, in k E / (1 + (k - 1) E)
CONTRAST = (0.1, 0.25)  # of b, in y - b sin(2 pi y) / (2 pi)
POWER = (0.0, 0.1)  # of log p, in y^p
DRAWN = 400  # cameras


@cache
def digital_cameras() -> ResponsePrior:
    """Digital cameras that write JPEG files: less different from each other than all of DoRF.

    The mean is that of drawn cameras: sRGB, a shoulder in the highlights, more or less
    contrast. The spread is half that of the responses of DoRF, most of which are of film.
    """
    rng = np.random.default_rng(0)
    samples = np.zeros_like(NODES)
    for _ in range(DRAWN):
        gain, power = np.exp([rng.normal(*SHOULDER), rng.normal(*POWER)])
        bend = rng.normal(*CONTRAST)
        light = gain * NODES / (1 + (gain - 1) * NODES)
        tone = SRGB().to_intensity(light) ** power
        samples += tone - bend * np.sin(2 * np.pi * tone) / (2 * np.pi)
    return around(Tabulated(NODES, samples / samples[-1]), share=0.5)


@cache
def srgb_like() -> ResponsePrior:
    """Curves near sRGB, as of edited or scanned pictures: a fifth of the spread of DoRF."""
    return around(SRGB())


def around(curve: ResponseCurve, share: float = 0.2) -> ResponsePrior:
    """Curves near a given one.

    Parameters
    ----------
    curve : ResponseCurve
        Mean, for example a curve that was measured or estimated from other photos.
    share : float
        Spread, as a share of that of the responses of DoRF.
    """
    arguments.instance(curve, ResponseCurve, "a response curve")
    arguments.number(share, "a share", above=0, most=LARGEST)
    mean = _strict(curve.to_intensity(NODES)).intensity
    return ResponsePrior(mean, share * _emor_directions(DORF_DEVIATIONS))


class Cameras(Enum):
    """Kinds of camera; the value says what is assumed of one before its photo is seen."""

    DIGITAL = "digital cameras"
    DORF = "film and digital cameras (DoRF)"
    SRGB = "close to sRGB"

    @property
    def prior(self) -> ResponsePrior:
        """The family of their responses."""
        return {
            Cameras.DIGITAL: digital_cameras,
            Cameras.DORF: film_and_digital,
            Cameras.SRGB: srgb_like,
        }[self]()
