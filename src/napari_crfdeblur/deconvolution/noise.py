"""How noisy and how contrasty a plane is: what sets the strength of a regularization."""

from dataclasses import dataclass
from math import prod

import numpy as np

from .. import arrays
from .._typing import FloatArray
from .noise_model import LightNoise, fit_noise

SAMPLES = 1 << 20  # enough for .2 % of the noise level
# Of the contrast: what even a given PSF, the rounding and the compression of a photo leave
# unexplained. On simulated and real photos of known truth, less rings.
LEAST_NOISE = 5e-3
# Of the contrast: what single precision adds in the transforms. Less is never reckoned with, not
# even in a picture without noise, since a weight of zero would divide by zero.
ROUNDING = 1e-5


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
    """

    noise: float
    contrast: float
    model: LightNoise | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.noise < np.inf:
            raise ValueError(f"expected a finite noise level of 0 or more, got {self.noise}")
        if not 0 < self.contrast < np.inf:
            raise ValueError(f"expected a finite contrast above 0, got {self.contrast}")

    def relative_noise(self, least: float = 0.0) -> float:
        """Noise level as a fraction of the contrast, at least `least` and that of rounding."""
        return max(self.noise / self.contrast, least, ROUNDING)


def measure(plane: FloatArray) -> PlaneStatistics:
    """Measure the noise and the contrast of a plane.

    The noise level is that of :func:`~.noise_model.fit_noise`: where it grows with the light, the
    median of all pixels would be that of the dark ones.

    Parameters
    ----------
    plane : ndarray, shape (M, N) or (Z, M, N)
        Any unit, finite. Of large planes only some rows are used.
    """
    model = fit_noise(plane)
    return PlaneStatistics(model.level, contrast(plane), model)


def check_weight(weight: float | None, model_error: float) -> None:
    """Raise ValueError unless the weight is positive or None, the error a share of 1."""
    if weight is not None and not 0 < weight < np.inf:
        raise ValueError(f"expected a weight above 0 or None, got {weight}")
    if not 0 <= model_error < 1:
        raise ValueError(f"expected a model error of 0 or more, below 1, got {model_error}")
