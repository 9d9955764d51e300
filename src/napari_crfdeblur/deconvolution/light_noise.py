"""Noise that grows with the light: its variance as a straight line, from one picture."""

from dataclasses import dataclass
from math import prod

import numpy as np

from .. import arguments, arrays
from .._typing import FloatArray

SAMPLES = 1 << 16  # enough for .5 % of the noise level
LEVELS = 16  # of light, equally many pixels in each
FEWEST = 200  # pixels of a level, for 10 % of its noise level
SATURATED = 1e-4  # of the range of light: so near its ends it is at them, but for rounding
TRUSTED = 0.2  # share by which the variance of a level errs; those that err more hardly count
REWEIGHTINGS = 8
LARGEST = 1e30  # variance: single precision holds it
LEAST = 0.02  # share of the mean variance that the noise of no pixel falls below


@dataclass(frozen=True, slots=True)
class LightNoise:
    """Variance of the noise of a pixel, ``max(gain * light + offset, least)``.

    The mixture of photon noise, whose variance is proportional to the light, and of noise of
    the readout, which is the same everywhere (Foi et al. 2008, Practical Poissonian-Gaussian
    noise modeling and fitting for single-image raw-data, IEEE TIP 17). A photo of 8 bits that was
    linearized is noisy much alike, since the inverse response is steeper where it is bright.

    Parameters
    ----------
    gain : float
        Growth of the variance with the light, 0 or more.
    offset : float
        Variance at light 0, if the line goes on to there; can be negative.
    least : float
        Variance that no pixel falls below, 0 or more.
    mean : float
        Mean variance over the picture, 0 or more.
    """

    gain: float
    offset: float
    least: float
    mean: float

    def __post_init__(self) -> None:
        values = {"gain": self.gain, "least": self.least, "mean": self.mean}
        for name, value in values.items():
            arguments.number(value, f"a finite {name}", least=0, most=LARGEST)
        arguments.number(self.offset, "a finite offset", least=-LARGEST, most=LARGEST)

    def scaled(self, share: float) -> "LightNoise":
        """The same with all variances times `share`."""
        return LightNoise(
            *(share * each for each in (self.gain, self.offset, self.least, self.mean))
        )

    @property
    def level(self) -> float:
        """Standard deviation, root mean square over the picture."""
        return float(self.mean**0.5)

    def variance(self, light: FloatArray) -> FloatArray:
        """Variance of the noise at this light, in the kind of the array and its shape."""
        variance: FloatArray = arrays.raised(self.gain * light + self.offset, self.least)
        return variance


def fit_noise(plane: FloatArray) -> LightNoise:
    """Fit the variance of the noise of a plane, as a line over the light.

    As in Foi et al. (2008), but with the noise of levels of light from the median of the finest
    details, ``median |L * y| / (6 * 0.6745)`` (Immerkaer 1996, Donoho 1995), instead of from
    wavelets: pixels are sorted by the mean of 3 x 3 of them, which white noise leaves uncorrelated
    to `L * y`. The line is fitted with levels reweighted, of which some are textured. Pixels
    without any detail at the darkest or the brightest light, as in saturated areas, do not count;
    elsewhere they show that there is no noise, as in drawings.

    Parameters
    ----------
    plane : ndarray, shape (M, N) or (Z, M, N)
        Linear light in any unit, finite. Of large planes only some pixels are used.

    Returns
    -------
    LightNoise
        In the unit of the plane, squared.
    """
    light, detail = _light_and_detail(check_plane(plane))
    count = min(LEVELS, len(light) // FEWEST)
    if count == 0:
        variance = _variance(detail)
        return LightNoise(0.0, variance, variance, variance)
    order = np.argsort(light)
    levels = [
        (light[part].mean(), _variance(detail[part])) for part in np.array_split(order, count)
    ]
    centers, variances = np.array(levels).T
    if not variances.any():
        return LightNoise(0.0, 0.0, 0.0, 0.0)
    return _line(centers, variances)


def check_plane(plane: FloatArray) -> FloatArray:
    """A plane or volume as an array of some library; refused unless of floats, all finite."""
    plane = arguments.array(plane, "a plane of floats", axes=(2, 3), kinds=("float",))
    if 0 in plane.shape:
        raise arguments.refusal("a plane with pixels", plane)
    arguments.check_pixels(plane)
    return plane


def _light_and_detail(plane: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of 3 x 3 pixels and ``|L * y|`` at some places that are not saturated."""
    if min(plane.shape[-2:]) < 3:
        return np.zeros(0), np.zeros(0)
    every = 1 + prod(plane.shape) // (4 * SAMPLES)
    above, row, below = (
        arrays.to_numpy(plane[..., first:last, :][..., ::every, :])
        for first, last in ((0, -2), (1, -1), (2, None))
    )
    bent, light = bent_and_mean(above, row, below)
    detail = np.abs(bent)
    low, high = (float(end) for end in (light.min(), light.max()))
    margin = SATURATED * (high - low)
    some = (detail > 0) | ((light > low + margin) & (light < high - margin))
    detail, light = detail[some], light[some]
    stride = 1 + detail.size // SAMPLES
    return np.asarray(light[::stride], dtype=float), np.asarray(detail[::stride], dtype=float)


def bent_and_mean(
    above: FloatArray, row: FloatArray, below: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """``L * y`` and the mean of 3 x 3 pixels, of rows with those above and below them."""
    bent, mean = above - 2 * row + below, above + row + below
    bent = bent[..., :-2] - 2 * bent[..., 1:-1] + bent[..., 2:]
    return bent, (mean[..., :-2] + mean[..., 1:-1] + mean[..., 2:]) / 9


def _variance(detail: FloatArray) -> float:
    return float((np.median(detail) / (6 * 0.6745)) ** 2) if detail.size else 0.0


def _line(light: FloatArray, variance: FloatArray) -> LightNoise:
    """Line through the variances of levels of light, each with an error in proportion to it."""
    mean = float(variance.mean())
    middle = float(light.mean())
    slope, height = 0.0, mean
    trust = np.ones_like(variance)
    for _ in range(REWEIGHTINGS):
        expected = np.maximum(slope * (light - middle) + height, LEAST * mean)
        weight = trust / expected**2
        center, height = (float(np.average(each, weights=weight)) for each in (light, variance))
        spread = np.average((light - center) ** 2, weights=weight)
        product = np.average((light - center) * (variance - height), weights=weight)
        slope, middle = max(float(product / spread), 0.0) if spread > 0 else 0.0, center
        expected = np.maximum(slope * (light - middle) + height, LEAST * mean)
        trust = 1 / (1 + ((variance / expected - 1) / TRUSTED) ** 2)
    fitted = np.maximum(slope * (light - middle) + height, LEAST * mean)
    return LightNoise(slope, height - slope * middle, LEAST * mean, float(fitted.mean()))
