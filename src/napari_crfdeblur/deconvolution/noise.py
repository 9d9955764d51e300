"""How noisy and how contrasty a plane is: what sets the strength of a regularization."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from types import NoneType

import numpy as np

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..psf.base import as_psf
from ..psf.misfit import misfit
from .light_noise import LightNoise, check_plane, fit_noise
from .quiet import quiet_share

SAMPLES = 1 << 20  # enough for .2 % of the noise level
LEAST_NOISE = 5e-3  # of the contrast: with less, all methods ring even where all is known
# Errors that are not white are the larger, the lower the frequency; and low ones, at which the
# picture is strong, decide how much regularization is best. So what is unexplained beyond white
# noise counts so many times: best for photos of known truth, where 2.5 and 3.5 are hardly worse.
COLORED = 3.0
# Of the contrast: what single precision adds in the transforms. Less is never reckoned with, not
# even in a picture without noise, since a weight of zero would divide by zero.
ROUNDING = 1e-5
SMALLEST = 1e-30  # contrast: single precision holds it and its inverse


def noise_level(plane: FloatArray) -> float:
    """Standard deviation of white noise in a plane, from its finest details.

    ``median |L * y| / (6 * 0.6745)``, where `L` is the mask ``[1, -2, 1]`` along rows and
    columns: blind to linear structure, of norm 6 (Immerkaer 1996, Fast noise variance
    estimation), with the median that edges hardly move (Donoho 1995). Pixels without any
    detail, as in saturated areas, do not count. Texture that survived the blur counts as noise.

    Parameters
    ----------
    plane : ndarray, shape (M, N) or (Z, M, N)
        Any unit, which is the unit of the result. Of large planes only some rows are used.
    """
    plane = check_plane(plane)
    if min(plane.shape[-2:]) < 3:
        return 0.0
    every = _every(plane)
    above, row, below = (
        _sampled(plane[..., first:last, :], every) for first, last in ((0, -2), (1, -1), (2, None))
    )
    rows = above - 2 * row + below
    detail = np.abs(rows[..., :-2] - 2 * rows[..., 1:-1] + rows[..., 2:])
    detail = detail[detail > 0]
    return float(np.median(detail)) / (6 * 0.6745) if detail.size else 0.0


def _every(plane: FloatArray) -> int:
    """Step between the rows that are used, so that they hold about `SAMPLES` pixels."""
    return 1 + prod(plane.shape) // SAMPLES


def _sampled(plane: FloatArray, every: int) -> FloatArray:
    """Some rows, as an array of numpy: few enough to be taken from any device."""
    rows: FloatArray = arrays.to_numpy(plane[..., ::every, :])
    return rows


def contrast(plane: FloatArray) -> float:
    """Four standard deviations: the full scale that a typical picture of it would have."""
    rows = _sampled(plane, _every(plane))
    spread = 4 * float(rows.std(dtype=np.float64))
    # a constant plane has only the rounding of its mean, and no scale
    return spread if spread > 1e-7 * float(np.abs(rows.flat[0])) else 1.0


@dataclass(frozen=True, slots=True)
class PlaneStatistics:
    """What sets the strength of a regularization, measured on a whole picture.

    Parameters
    ----------
    noise : float
        Standard deviation of the white noise, root mean square over the picture, in its unit.
    contrast : float
        Full scale that a typical picture of the same spread would have, above 0.
    model : LightNoise, optional
        How the noise depends on the light; by default it does not.
    misfit : float, optional
        What the PSF leaves unexplained (:func:`~napari_crfdeblur.psf.misfit.misfit`), in its unit;
        by default no more than noise.
    reckoned : float
        Share of these errors that is reckoned with, above 0.
    """

    noise: float
    contrast: float
    model: LightNoise | None = None
    misfit: float | None = None
    reckoned: float = 1.0

    def __post_init__(self) -> None:
        arguments.number(self.noise, "a finite noise level", least=0, most=1 / SMALLEST)
        what = "a finite contrast above 0"
        arguments.number(self.contrast, what, least=SMALLEST, most=1 / SMALLEST)
        arguments.instance(self.model, (LightNoise, NoneType), "a LightNoise or None")
        if self.misfit is not None:
            arguments.number(self.misfit, "a misfit", least=0, most=1 / SMALLEST)
        arguments.number(self.reckoned, "a share of errors", least=SMALLEST, most=1 / SMALLEST)

    def relative_noise(self, model_error: float | None = None) -> float:
        """Noise level that is reckoned with, as a fraction of the contrast.

        Parameters
        ----------
        model_error : float, optional
            Least value. By default it follows from the misfit, so that this stands for all errors.
        """
        return self.reckoned * self._relative_noise(model_error)

    def _relative_noise(self, model_error: float | None) -> float:
        if model_error is not None:
            return max(self.noise / self.contrast, model_error, ROUNDING)
        excess = max((self.misfit or 0.0) ** 2 - self.noise**2, 0.0)
        level = float(np.sqrt(self.noise**2 + COLORED * excess))
        return max(level / self.contrast, LEAST_NOISE)


def measure(
    plane: FloatArray, psf: FloatArray | None = None, clipped: BoolArray | None = None
) -> PlaneStatistics:
    """Measure the noise and the contrast of a plane, and what its PSF leaves unexplained.

    The noise level is that of :func:`~.light_noise.fit_noise`: where it grows with the light, the
    median of all pixels would be that of the dark ones. Where texture survived the blur, it is that
    of the quietest places (:func:`~.quiet.quiet_share`).

    Parameters
    ----------
    plane : ndarray, shape (M, N) or (Z, M, N)
        Any unit, finite. Of large planes only some rows are used.
    psf : ndarray, shape (H, W) or (D, H, W), optional
        Made by :func:`~napari_crfdeblur.psf.as_psf`, for the misfit, which planes have alone.
    clipped : ndarray of bool, the shape of `plane`, optional
        True where the camera saturated: the misfit is not measured there.
    """
    plane = check_plane(plane)
    psf = None if psf is None else as_psf(psf)
    if clipped is not None:
        clipped = arguments.array(clipped, "clipped pixels as bool", kinds=("bool",))
    if clipped is not None and clipped.shape != plane.shape:
        raise arguments.refusal(f"clipped pixels of shape {tuple(plane.shape)}", clipped)
    model = fit_noise(plane)
    model = model.scaled(quiet_share(plane, model))
    lost = None if clipped is None else [clipped]
    unexplained = None if psf is None else misfit([plane], psf, lost)
    return PlaneStatistics(model.level, contrast(plane), model, unexplained)


def measure_channels(
    linear: FloatArray, psf: FloatArray, clipped: BoolArray | None = None
) -> list[PlaneStatistics]:
    """Measure each channel of a picture or volume, as :func:`measure` does a plane."""
    psf = as_psf(psf)
    axes = psf.ndim, psf.ndim + 1
    linear = arguments.array(linear, "an image that fits the PSF", axes=axes, kinds=("float",))
    if clipped is not None:
        clipped = arguments.array(clipped, "clipped pixels as bool", kinds=("bool",))
        if clipped.shape != linear.shape:
            raise arguments.refusal(f"clipped pixels of shape {tuple(linear.shape)}", clipped)
    found = []
    for channel in np.ndindex(tuple(linear.shape[psf.ndim :])):
        own = (..., *channel)
        lost = None if clipped is None else arrays.contiguous(clipped[own])
        found.append(measure(arrays.contiguous(linear[own]), psf, lost))
    return found


def checked_statistics(
    statistics: Sequence[PlaneStatistics], linear: FloatArray, axes: int
) -> Sequence[PlaneStatistics]:
    """Statistics of each channel of a picture with so many other axes."""
    found = arguments.instances(statistics, PlaneStatistics, "statistics of each channel")
    count = linear.shape[-1] if linear.ndim > axes else 1
    if len(found) != count:
        raise ValueError(f"expected statistics of {count} channels, got {len(found)}")
    return found
