"""A response that the user already has."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .. import arguments
from ..profiles.base import ProfileGroup
from ..progress import Job, Progress
from ..response import Response, ResponseCurve
from .band import covered_range
from .base import ResponseEstimate, ResponseFit, Responses, ResponseStatus


@dataclass(frozen=True, slots=True)
class GivenResponse(ResponseFit):
    """The response that was given, whatever the profiles show.

    Parameters
    ----------
    curve : ResponseCurve
        For example ``Gamma(2.2)`` or a curve that was estimated from other photos.
    """

    curve: ResponseCurve

    def __post_init__(self) -> None:
        arguments.instance(self.curve, ResponseCurve, "a response curve")

    @property
    def needs_profiles(self) -> bool:
        """None: the curve is known."""
        return False

    def run(self, groups: Sequence[ProfileGroup]) -> Job[ResponseEstimate]:
        """Long job: hand out the curve, with a band of no width."""
        yield Progress("given response", 1, 1)
        return self.estimate(covered_range(groups) if any(map(len, groups)) else (0.0, 1.0))

    def estimate(self, covered: tuple[float, float] = (0.0, 1.0)) -> ResponseEstimate:
        """The curve as an estimate that covers the given range of intensity."""
        intensity = np.linspace(0, 1, 257)
        irradiance = self.curve.to_irradiance(intensity)
        return ResponseEstimate(
            self.curve, intensity, irradiance, irradiance, covered, ResponseStatus.GIVEN
        )


def given_responses(curve: Response) -> Responses:
    """Curves that are known, as if they had been estimated.

    Parameters
    ----------
    curve : ResponseCurve or sequence of 3 of them
        One for all channels, or one for each.

    Raises
    ------
    ValueError
        Not one curve or three.
    """
    what = "one response curve or 3, one for each channel"
    curves = (curve,) if isinstance(curve, ResponseCurve) else curve
    if len(arguments.instances(curves, ResponseCurve, what)) not in (1, 3):
        raise arguments.refusal(what, curves)
    return Responses(tuple(GivenResponse(own).estimate() for own in curves))
