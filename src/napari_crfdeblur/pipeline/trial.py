"""The light of a photo whose response is a guess: that in which the restoration rings least."""

from dataclasses import dataclass, replace

import numpy as np

from .. import arguments
from .._typing import BoolArray, FloatArray
from ..deconvolution import Deconvolver, deconvolving, judging, measure_channels
from ..estimate import Finding, ResponseEstimate, Responses
from ..progress import Job, Progress
from ..psf.blind.overview import Overview
from ..response import Identity

WIDEST = 1024  # pixels in a side of the part of a large photo that is tried
# Share of the restoration that the guard keeps, from which on no other light is tried; and by which
# more must be kept in another.
ENOUGH, BETTER = 0.9, 0.1


@dataclass(frozen=True, slots=True)
class LightTrial:
    """How much of a restoration the guard keeps, in the light of each response that was tried.

    Parameters
    ----------
    assumed, recorded : float, optional
        With the response that was assumed, and with the values of the photo taken as light; None
        if it was not tried.
    """

    assumed: float | None = None
    recorded: float | None = None

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if value is not None:
                arguments.number(value, "a share", least=0, most=1)

    @property
    def prefers_recorded(self) -> bool:
        """Whether the values of the photo had better be taken as light."""
        if self.assumed is None or self.recorded is None:
            return False
        return self.recorded > self.assumed + BETTER


def trying_light(
    linear: FloatArray,
    recorded: FloatArray,
    lamps: BoolArray,
    psf: FloatArray,
    method: Deconvolver,
) -> Job[LightTrial]:
    """Long job: restore a photo in the light that is assumed, and if it rings, in that recorded.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, 3)
        Light by the response that is assumed.
    recorded : ndarray, the shape of `linear`
        Values of the photo in [0, 1].
    lamps : ndarray of bool, the shape of `linear`
        Where light was brighter than recorded.
    psf : ndarray, shape (H, W)
    method : Deconvolver
    """
    assumed = yield from _keeping(linear, lamps, psf, method)
    if assumed >= ENOUGH:
        return LightTrial(assumed)
    return LightTrial(assumed, (yield from _keeping(recorded, lamps, psf, method)))


def taken_as_light(responses: Responses) -> Responses:
    """The values of the photo taken as light; the bands hold that and what was assumed."""
    return Responses(tuple(_taken_as_light(own) for own in responses.estimates))


def _taken_as_light(assumed: ResponseEstimate) -> ResponseEstimate:
    return replace(
        assumed,
        curve=Identity(),
        lower=np.minimum(assumed.lower, assumed.intensity),
        upper=np.maximum(assumed.upper, assumed.intensity),
        findings=(Finding.RINGS, *assumed.findings),
        posterior=None,
    )


def _keeping(
    light: FloatArray, lamps: BoolArray, psf: FloatArray, method: Deconvolver
) -> Job[float]:
    """Long job: share of a restoration of gray light that the guard keeps."""
    yield Progress("trying the light", 0, 1)
    if light.ndim == 3:
        light, lamps = light.mean(axis=2), np.asarray(lamps.any(axis=2))
    size = max(psf.shape)
    part = Overview.of(light, lamps).informative_region(max(WIDEST, 3 * size), size)
    light, lamps = light[part], lamps[part]
    statistics = measure_channels(light, psf, lamps)
    sharp = yield from deconvolving(light, psf, method, clipped=lamps, statistics=statistics)
    judged = yield from judging(light, sharp, psf, clipped=lamps, statistics=statistics)
    return float(judged.trust.kept.mean())
