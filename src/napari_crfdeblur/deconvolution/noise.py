"""How noisy and how contrasty a plane is: what sets the strength of a regularization."""

import numpy as np

from .._typing import FloatArray

SAMPLES = 1 << 20  # enough for .2 % of the noise level
# Of the contrast: what even a given PSF, the rounding and the compression of a photo leave
# unexplained. On simulated and real photos of known truth, less rings.
LEAST_NOISE = 5e-3


def noise_level(plane: FloatArray) -> float:
    """Standard deviation of white noise in a plane, from its finest details.

    ``median |L * y| / (6 * 0.6745)``, where `L` is the mask ``[1, -2, 1]`` along both axes:
    blind to linear structure, of norm 6 (Immerkaer 1996, Fast noise variance estimation),
    with the median that edges hardly move (Donoho 1995). Pixels without any detail, as in
    saturated areas, do not count. Texture that survived the blur counts as noise.

    Parameters
    ----------
    plane : ndarray, shape (M, N)
        Any unit, which is the unit of the result. Of large planes only some rows are used.
    """
    if min(plane.shape) < 3:
        return 0.0
    every = _every(plane)
    rows = plane[:-2:every] - 2 * plane[1:-1:every] + plane[2::every]
    detail = np.abs(rows[:, :-2] - 2 * rows[:, 1:-1] + rows[:, 2:])
    detail = detail[detail > 0]
    return float(np.median(detail)) / (6 * 0.6745) if detail.size else 0.0


def _every(plane: FloatArray) -> int:
    """Step between the rows that are used, so that they hold about `SAMPLES` pixels."""
    return 1 + plane.size // SAMPLES


def contrast(plane: FloatArray) -> float:
    """Four standard deviations: the full scale that a typical picture of it would have."""
    spread = 4 * float(plane[:: _every(plane)].std(dtype=np.float64))
    # a constant plane has only the rounding of its mean, and no scale
    return spread if spread > 1e-7 * float(np.abs(plane[0, 0])) else 1.0


def relative_noise(plane: FloatArray, least: float = 0.0) -> float:
    """Noise level as a fraction of the contrast, at least `least`."""
    return max(noise_level(plane) / contrast(plane), least)


def check_weight(weight: float | None, model_error: float) -> None:
    """Raise ValueError unless the weight is positive or None, the error a share of 1."""
    if weight is not None and not 0 < weight < np.inf:
        raise ValueError(f"expected a weight above 0 or None, got {weight}")
    if not 0 <= model_error < 1:
        raise ValueError(f"expected a model error of 0 or more, below 1, got {model_error}")
