"""What keeps Richardson-Lucy from turning noise into detail: total variation, damping."""

from .. import arrays
from .._typing import FloatArray
from .noise import PlaneStatistics

SHARPNESS = 10  # `N` of White (1994): how abruptly damping sets in
FLAT = 1e-3  # of the mean light: a gradient below it is none, and has no direction
NOTHING = 1e-30  # light, or its variance, of a picture without any
LEAST_DIVISOR = 0.1  # where weights are large, so that steps stay finite


def smoothed(share: FloatArray, scene: FloatArray, weight: float) -> FloatArray:
    """One over what divides the correction of a step, with total variation as prior.

    ``1 / (k' * m - w div(D x / |D x|))``: Dey et al. (2006, Richardson-Lucy algorithm with total
    variation regularization for 3D confocal microscope deconvolution), whose ``k' * 1`` is 1.

    Parameters
    ----------
    share : ndarray
        ``1 / (k' * m)``, or 0 where a pixel stays as it is.
    scene : ndarray
        `x`, periodic, 0 or more.
    weight : float
        `w`, without unit: changes of scale commute with it.
    """
    xp = arrays.namespace(scene)
    gradient = [xp.roll(scene, -1, axis=axis) - scene for axis in range(scene.ndim)]
    size = sum(each * each for each in gradient) ** 0.5
    arrays.raise_to(size, max(FLAT * arrays.mean(scene), NOTHING))
    divisor = 1 + 0 * scene
    for axis, each in enumerate(gradient):
        each /= size
        # the divergence, which is minus the adjoint of the differences
        divisor -= weight * share * (each - xp.roll(each, 1, axis=axis))
    arrays.raise_to(divisor, LEAST_DIVISOR)
    result: FloatArray = share / divisor
    return result


def undamped(
    plane: FloatArray, predicted: FloatArray, statistics: PlaneStatistics, threshold: float
) -> FloatArray:
    """Share of each pixel's correction that damping leaves.

    ``U^(N-1) (N - (N-1) U)``, where `U` is the squared difference between the recorded and the
    predicted light over that of `threshold` standard deviations of the noise, at most 1: White
    (1994, Image restoration using the damped Richardson-Lucy method), with the variance of
    photon noise and readout noise together instead of the likelihood of photon noise alone.
    What is explained to within the noise is left as it is.

    Parameters
    ----------
    plane, predicted : ndarray, the same shape
        Recorded light, and what the scene found so far would record.
    statistics : PlaneStatistics
        Noise of the plane.
    threshold : float
        Standard deviations, above 0.
    """
    if statistics.model is None:
        variance = statistics.noise**2 + 0 * predicted
    else:
        variance = statistics.model.variance(predicted)
    excess = (plane - predicted) ** 2 / (threshold**2 * arrays.raised(variance, NOTHING))
    excess = 1 - arrays.raised(1 - excess, 0.0)
    result: FloatArray = excess ** (SHARPNESS - 1) * (SHARPNESS - (SHARPNESS - 1) * excess)
    return result
