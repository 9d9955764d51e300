"""Edge spreads as evidence for a PSF: profiles in linear light, from one side to the other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...profiles.base import ProfileGroup
from ...response import Response, ResponseCurve

LEAST_CONTRAST = 0.02  # of a profile in linear light: less is noise and rounding
LEAST_LIGHT = 1e-4  # where the slope of a response is taken; it can be infinite at 0
LEAST_SLOPE = 1e-2  # of a response: where it is flatter, it tells next to nothing
FLOOR = 1e-3  # standard deviation of what is left of any profile, in recorded intensity
MISMATCH = 0.01  # the same, as a share of the contrast: sides are not even, edges no steps


@dataclass(frozen=True, slots=True, eq=False)
class EdgeSpreads:
    """Profiles of one orientation in linear light, each from 0 on one side to 1 on the other.

    Parameters
    ----------
    position : ndarray, shape (M,)
        Distance along the normal, pixels, increasing by equal steps.
    orientation : float
        Angle of the normal, radians.
    spread : ndarray, shape (J, M)
        ``(E - E_0) / (E_1 - E_0)``, with the light `E_0`, `E_1` of the two sides; those that
        rise and those that fall are thereby alike.
    variance : ndarray, shape (J, M)
        Variance of each sample of `spread`.
    ends_variance : ndarray, shape (J, 2)
        Variance of the two sides, in the same unit.
    """

    position: FloatArray
    orientation: float
    spread: FloatArray
    variance: FloatArray
    ends_variance: FloatArray

    @property
    def normal(self) -> FloatArray:
        """Unit vector across the edges, (row, column)."""
        return np.array([np.sin(self.orientation), np.cos(self.orientation)])

    @property
    def step(self) -> float:
        """Spacing of the samples, pixels."""
        return float(self.position[1] - self.position[0])

    @property
    def precision(self) -> FloatArray:
        """Inverse variance of each profile on the average, shape (J,)."""
        return np.asarray(1 / self.variance.mean(axis=1))

    @property
    def mean(self) -> FloatArray:
        """Weighted mean of the spreads, shape (M,)."""
        return np.asarray(np.average(self.spread, axis=0, weights=self.precision))

    @property
    def middle(self) -> float:
        """Centroid of the transition, pixels: that of the PSF lies there in any direction."""
        beyond = self.position[-1] + self.step / 2
        return float(beyond - self.mean.sum() * self.step)

    def width(self, faint: float) -> float:
        """Distance on which the mean rises from `faint` to ``1 - faint``, pixels."""
        mean = self.mean
        forth, back = np.maximum.accumulate(mean), np.minimum.accumulate(mean[::-1])[::-1]
        rising = (forth + back) / 2
        # Where noise makes it level, the crossings are told apart by a negligible slope.
        rising = rising + 1e-9 * np.arange(rising.size)
        return float(np.ptp(np.interp([faint, 1 - faint], rising, self.position)))


def linearized(groups: Sequence[ProfileGroup], response: Response) -> tuple[EdgeSpreads, ...]:
    """The spreads of all groups whose profiles have contrast in linear light: at least one."""
    spreads = clear_spreads(groups, response)
    if not spreads:
        raise CrfDeblurError(
            "there are no profiles with contrast to find the PSF from; find or draw more edges, "
            "or estimate the PSF from the picture"
        )
    return spreads


def clear_spreads(groups: Sequence[ProfileGroup], response: Response) -> tuple[EdgeSpreads, ...]:
    """The spreads of all groups whose profiles have contrast in linear light."""
    found = [_linearized(group, response) for group in groups]
    return tuple(group for group in found if group is not None)


def _linearized(group: ProfileGroup, response: Response) -> EdgeSpreads | None:
    intensity = np.concatenate([group.sides, group.intensity], axis=1)
    variance = np.concatenate([group.sides_variance, group.variance], axis=1) + FLOOR**2
    light, gain = np.empty_like(intensity), np.empty_like(intensity)
    channels = np.array([source.channel for source in group.sources], dtype=int)
    for channel in np.unique(channels):
        own = channels == channel
        curve = _curve(response, int(channel))
        light[own] = curve.to_irradiance(intensity[own])
        slope = curve.slope(np.maximum(light[own], LEAST_LIGHT))
        gain[own] = 1 / np.maximum(slope, LEAST_SLOPE)
    contrast = light[:, 1] - light[:, 0]
    clear = np.abs(contrast) >= LEAST_CONTRAST
    if not clear.any() or group.position.size < 2:
        return None
    light, contrast = light[clear], contrast[clear, np.newaxis]
    variance = variance[clear] * (gain[clear] / contrast) ** 2 + MISMATCH**2
    spread = (light[:, 2:] - light[:, :1]) / contrast
    return EdgeSpreads(group.position, group.orientation, spread, variance[:, 2:], variance[:, :2])


def _curve(response: Response, channel: int) -> ResponseCurve:
    """The one curve of all channels, or that of one."""
    if isinstance(response, ResponseCurve):
        return response
    if channel >= len(response):
        raise ValueError(
            f"expected one curve or one for each channel, got {len(response)} and a profile "
            f"of channel {channel}"
        )
    return response[channel]
