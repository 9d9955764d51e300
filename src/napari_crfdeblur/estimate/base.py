"""The stage from profiles to the camera response: verb, method, result."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from types import NoneType
from typing import Protocol, Self, runtime_checkable

import numpy as np

from .. import arguments
from .._typing import FloatArray
from ..profiles.base import ProfileGroup
from ..progress import Job, drain
from ..response import Response, ResponseCurve, ResponsePrior
from .band import TWO_SIDED_95


class ResponseStatus(Enum):
    """How far a response can be trusted; the value is the sentence that the user reads."""

    GOOD = "the edges determine the response over the range that they cover"
    GIVEN = "the response was given"
    DOUBTFUL = (
        "the edges hardly determine the response: add edges between areas of other "
        "brightness, or more photos of the same camera"
    )
    CANNOT_TELL = (
        "the edges cannot tell the response: this is what was assumed of the camera before; add "
        "edges between areas of other brightness, or more photos of the same camera"
    )
    NOT_CONVERGED = (
        "the search for the response did not converge: remove edges that are not straight "
        "steps, or choose another method"
    )


class Finding(Enum):
    """Why a response is in doubt; the value is the sentence that the user reads."""

    NO_EDGES = (
        "no straight edge lies between two even areas of clearly different brightness: draw one, "
        "or give the response (gamma or sRGB)"
    )
    FEW_EDGES = "there are only a few edges: find or draw more"
    NARROW = "the edges cover a small part of the intensities: add darker or brighter ones"
    ALIKE = (
        "the edges are too much alike (one dark side, one bright side or one contrast), so that "
        "any power of the response fits: add others"
    )
    MISFIT = (
        "the profiles differ from blurred steps by far more than their noise: remove edges that "
        "are not straight steps between even areas"
    )
    UNSURE = "what the edges say leaves a wide band"
    MISREGISTERED = (
        "the color channels lie clearly beside each other: correct the lateral chromatic "
        "aberration first"
    )
    RINGS = (
        "with the response that was assumed the restored photo rings, and less so with its values "
        "taken as light, as they are now; give the response if you know it"
    )
    CONTRADICTION = (
        "the photos contradict each other, or what was known of the camera: they are not of one "
        "camera in one picture style; estimate them apart"
    )


DARKEST = 1e-4  # light: a power law has no slope at 0


@dataclass(frozen=True, slots=True, eq=False)
class ResponseEstimate:
    """A response found from profiles, with the range in which they speak for it.

    Parameters
    ----------
    curve : ResponseCurve
        The estimate.
    intensity : ndarray, shape (N,)
        Where the band is sampled, increasing from 0 to 1.
    lower, upper : ndarray, shape (N,)
        95 % band of the irradiance at `intensity`.
    covered : (float, float)
        Range of intensity that the profiles cover, 1st to 99th percentile of their samples.
    status : ResponseStatus
        How far the curve can be trusted.
    diagnostics : dict of str to float
        Figures of the method, by name.
    findings : tuple of Finding
        Why the curve is in doubt, if it is.
    posterior : ResponsePrior, optional
        What is known of this camera now: the prior for its next photo.
    """

    curve: ResponseCurve
    intensity: FloatArray
    lower: FloatArray
    upper: FloatArray
    covered: tuple[float, float]
    status: ResponseStatus
    diagnostics: dict[str, float] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    posterior: ResponsePrior | None = None

    def __post_init__(self) -> None:
        arguments.instance(self.curve, ResponseCurve, "a response curve")
        arguments.instance(self.status, ResponseStatus, "a status of a response")
        arguments.instance(self.diagnostics, dict, "figures by their names")
        arguments.instance(self.posterior, (ResponsePrior, NoneType), "a prior or None")
        findings = arguments.instances(self.findings, Finding, "findings about a response")
        object.__setattr__(self, "findings", tuple(findings))
        covered = arguments.numbers(self.covered, "a range of intensity", count=2)
        object.__setattr__(self, "covered", covered)
        for name in ("intensity", "lower", "upper"):
            values = arguments.kept(getattr(self, name), f"samples of {name}", axes=(1,))
            object.__setattr__(self, name, values)
        if not self.intensity.shape == self.lower.shape == self.upper.shape:
            raise ValueError(
                f"expected a band at {self.intensity.size} intensities, got {self.lower.size} "
                f"and {self.upper.size}"
            )

    def slope_error(self, irradiance: FloatArray) -> FloatArray:
        """Relative standard error of the slope of the inverse response at some irradiance.

        From how the width of the band changes: where it does not, all light is wrong by the same
        amount, and no difference is.
        """
        light = np.clip(irradiance, DARKEST, 1)
        if self.intensity.size < 2:
            return np.zeros_like(light)
        deviation = (self.upper - self.lower) / (2 * TWO_SIDED_95)
        change = np.abs(np.gradient(deviation, self.intensity))
        error = np.interp(self.curve.to_intensity(light), self.intensity, change)
        return np.minimum(error * self.curve.slope(light), 1.0)


@runtime_checkable
class LiveEstimate(Protocol):
    """An estimate that can follow its profiles while they change, a step at a time."""

    @property
    def estimate(self) -> ResponseEstimate:
        """The estimate from the profiles as they are."""

    def refit(self, groups: Sequence[ProfileGroup]) -> Self | None:
        """The estimate from other profiles; None if that takes a full estimate."""


@dataclass(frozen=True, slots=True, eq=False)
class Responses:
    """The response of a camera: one curve for all channels, or one for each.

    Parameters
    ----------
    estimates : tuple of ResponseEstimate
        One for all channels, or one for each.
    fits : tuple of LiveEstimate
        What it takes to follow the profiles from here, for each estimate; empty if it cannot.
    """

    estimates: tuple[ResponseEstimate, ...]
    fits: tuple[LiveEstimate, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        what = "an estimate of all channels, or of each"
        estimates = arguments.instances(self.estimates, ResponseEstimate, what)
        if not estimates:
            raise arguments.refusal(what, estimates)
        fits = arguments.instances(self.fits, LiveEstimate, "estimates that follow their profiles")
        object.__setattr__(self, "estimates", tuple(estimates))
        object.__setattr__(self, "fits", tuple(fits))

    @property
    def curve(self) -> Response:
        """The curve of all channels, or the curves of each."""
        curves = [estimate.curve for estimate in self.estimates]
        return curves[0] if len(curves) == 1 else curves

    @property
    def certain(self) -> bool:
        """Whether the photo, or the user, tells them all; otherwise one is a guess."""
        told = ResponseStatus.GOOD, ResponseStatus.GIVEN
        return all(estimate.status in told for estimate in self.estimates)


class ResponseFit(ABC):
    """A method to find the response from groups of profiles."""

    @property
    def needs_profiles(self) -> bool:
        """Whether it looks at profiles at all."""
        return True

    @property
    def channels(self) -> int | None:
        """How many channels a photo must have; None for any."""
        return None

    def arranged(self, groups: Sequence[ProfileGroup]) -> tuple[ProfileGroup, ...]:
        """Profiles by orientation in the groups that tell this method most."""
        return tuple(groups)

    @abstractmethod
    def run(self, groups: Sequence[ProfileGroup]) -> Job[ResponseEstimate]:
        """Long job: estimate one response from groups of one camera."""

    def fitting(self, groups: Sequence[ProfileGroup]) -> Job[Responses]:
        """Long job: the response of all channels, or of each, as the method has it."""
        return Responses(((yield from self.run(groups)),))


def estimating_response(
    groups: Sequence[ProfileGroup], method: ResponseFit
) -> Job[ResponseEstimate]:
    """Job of :func:`estimate_response`: reports progress, can be stopped."""
    _check(groups, method)
    return (yield from method.run(groups))


def estimating_responses(groups: Sequence[ProfileGroup], method: ResponseFit) -> Job[Responses]:
    """Job of :func:`estimate_responses`: reports progress, can be stopped."""
    _check(groups, method)
    return (yield from method.fitting(groups))


def estimate_responses(groups: Sequence[ProfileGroup], method: ResponseFit) -> Responses:
    """Estimate the response of all channels, or of each if the method is for each.

    Parameters
    ----------
    groups : sequence of ProfileGroup
        As for :func:`estimate_response`.
    method : ResponseFit
        For example :class:`~napari_crfdeblur.estimate.PerChannel`.

    Raises
    ------
    CrfDeblurError
        As :func:`estimate_response`.
    """
    return drain(estimating_responses(groups, method))


def _check(groups: Sequence[ProfileGroup], method: ResponseFit) -> None:
    arguments.instance(method, ResponseFit, "a method to find a response")
    arguments.instances(groups, ProfileGroup, "a sequence of groups of profiles")


def estimate_response(groups: Sequence[ProfileGroup], method: ResponseFit) -> ResponseEstimate:
    """Estimate the camera response from profiles across straight edges.

    Parameters
    ----------
    groups : sequence of ProfileGroup
        Profiles of one camera, from one photo or several: groups simply add.
    method : ResponseFit
        For example :class:`~napari_crfdeblur.estimate.MaximumLikelihood`.

    Raises
    ------
    CrfDeblurError
        The profiles cannot determine a response, and the method assumes nothing of the camera
        that could be handed out instead.
    """
    return drain(estimating_response(groups, method))
