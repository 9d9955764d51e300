"""A response for each color channel instead of one for all."""

from collections.abc import Sequence
from dataclasses import dataclass

from .. import arguments
from ..profiles import of_channel
from ..profiles.base import ProfileGroup
from ..progress import Job
from ..response import ResponseCurve
from .base import ResponseEstimate, ResponseFit, Responses
from .given import GivenResponse

CHANNELS = 3  # red, green, blue


@dataclass(frozen=True, slots=True)
class PerChannel(ResponseFit):
    """Each channel by a method of its own, from its own profiles.

    Parameters
    ----------
    fits : tuple of 3 ResponseFit
        Methods for red, green and blue, each for one response.
    """

    fits: tuple[ResponseFit, ...]

    def __post_init__(self) -> None:
        what = f"{CHANNELS} methods to find a response, one for each channel"
        fits = arguments.instances(self.fits, ResponseFit, what)
        if len(fits) != CHANNELS or any(isinstance(fit, PerChannel) for fit in fits):
            raise arguments.refusal(what, fits)
        object.__setattr__(self, "fits", tuple(fits))

    @classmethod
    def alike(cls, fit: ResponseFit) -> "PerChannel":
        """The same method for every channel."""
        return cls((fit,) * CHANNELS)

    @classmethod
    def given(cls, curves: Sequence[ResponseCurve]) -> ResponseFit:
        """Curves that are known: one for all channels, or one for each."""
        fits = tuple(GivenResponse(curve) for curve in curves)
        return fits[0] if len(fits) == 1 else cls(fits)

    @property
    def needs_profiles(self) -> bool:
        """Whether any channel looks at profiles."""
        return any(fit.needs_profiles for fit in self.fits)

    @property
    def channels(self) -> int | None:
        """Of the photo: one for each method."""
        return CHANNELS

    def run(self, groups: Sequence[ProfileGroup]) -> Job[ResponseEstimate]:
        """Long job: the response of the one channel that the profiles are of.

        Raises
        ------
        ValueError
            They are of several channels; see :func:`~.base.estimate_responses`.
        """
        found = {source.channel for group in groups for source in group.sources}
        if len(found) != 1:
            raise ValueError(
                f"expected profiles of one channel, got those of {len(found)}; "
                "use estimate_responses"
            )
        return (yield from self.fits[found.pop()].run(groups))

    def fitting(self, groups: Sequence[ProfileGroup]) -> Job[Responses]:
        """Long job: the responses of all channels."""
        each = []
        for channel, fit in enumerate(self.fits):
            each.append((yield from fit.fitting(of_channel(groups, channel))))
        fits = tuple(fit for own in each for fit in own.fits)
        whole = fits if len(fits) == len(each) else ()
        return Responses(tuple(own.estimates[0] for own in each), whole)
