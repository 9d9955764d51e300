"""The whole path: photo -> edges -> profiles -> response -> linear -> PSF -> sharp photo."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from ._typing import FloatArray, Image
from .deconvolve import Deconvolver, HyperLaplacian, deconvolving
from .edges import Edge, Line, Rectangle, estimate_blur_extent, find_edges, refine_edges
from .errors import CrfDeblurError
from .estimate import (
    GivenResponse,
    RankMinimization,
    ResponseEstimate,
    ResponseFit,
    estimating_response,
)
from .linear import linearize, reapply
from .photo import ALPHA, check_photo, color, planes
from .profiles import ProfileGroup, of_channel, sample_profiles
from .progress import Job, Progress, drain
from .psf import PsfEstimate, PsfEstimator, XuJia, estimating_psf


class ResponseScope(Enum):
    """What one response stands for."""

    SHARED = "one response for all channels"
    PER_CHANNEL = "one response for each channel"


@dataclass(frozen=True, slots=True)
class DeblurOptions:
    """How a photo is deblurred; the defaults do everything from the photo itself.

    Parameters
    ----------
    response : ResponseFit
        How the response is found; :class:`~.estimate.GivenResponse` if it is known.
    scope : ResponseScope
        One response for all colour channels or one for each.
    edges : sequence of Line or Rectangle, optional
        Edges drawn by the user; found automatically if not given.
    blur_extent : float, optional
        Largest width of a blurred edge in pixels; judged from the photo if not given.
    psf : PsfEstimator, optional
        How the PSF is found; by default :class:`~.psf.XuJia` of the size of the blur, or
        :class:`~.psf.GivenPsf` if it is known.
    method : Deconvolver
        How the blur is undone.
    """

    response: ResponseFit = field(default_factory=RankMinimization)
    scope: ResponseScope = ResponseScope.SHARED
    edges: Sequence[Line | Rectangle] | None = None
    blur_extent: float | None = None
    psf: PsfEstimator | None = None
    method: Deconvolver = field(default_factory=HyperLaplacian)


@dataclass(frozen=True, slots=True, eq=False)
class Deblurred:
    """Every intermediate of the whole path.

    Parameters
    ----------
    edges : tuple of Edge
        All edges, those that were rejected with their reason; empty if none were needed.
    groups : tuple of ProfileGroup
        Profiles across the good edges.
    responses : tuple of ResponseEstimate
        One for all channels, or one for each.
    linear : ndarray, shape (M, N) or (M, N, 3)
        Relative irradiance of the photo.
    psf : PsfEstimate
        Point spread function.
    sharp_linear : ndarray, the shape of `linear`
        Deconvolved irradiance; it can leave [0, 1].
    photo : ndarray
        The result: the response re-applied; shape and kind of the input, alpha kept.
    """

    edges: tuple[Edge, ...]
    groups: tuple[ProfileGroup, ...]
    responses: tuple[ResponseEstimate, ...]
    linear: FloatArray
    psf: PsfEstimate
    sharp_linear: FloatArray
    photo: Image

    @property
    def clipped(self) -> float:
        """Share of the deconvolved values outside [0, 1], lost when the response is applied."""
        outside = np.count_nonzero(self.sharp_linear < 0) + np.count_nonzero(self.sharp_linear > 1)
        return outside / self.sharp_linear.size


def deblurring(photo: Image, options: DeblurOptions | None = None) -> Job[Deblurred]:
    """Job of :func:`deblur`: reports progress, can be stopped."""
    options = options or DeblurOptions()
    check_photo(photo)
    yield Progress("edges", 0, 1)
    edges = _edges(photo, options)
    groups = tuple(sample_profiles(photo, edges))
    responses = yield from estimating_responses(photo, groups, options.response, options.scope)
    curves = [r.curve for r in responses]
    response = curves[0] if len(curves) == 1 else curves
    linear = linearize(color(photo), response)
    psf = yield from estimating_psf(linear, options.psf or _psf_estimator(photo, edges, options))
    sharp_linear = yield from deconvolving(linear, psf.psf, options.method)
    sharp = reapply(sharp_linear, response, photo.dtype)
    return Deblurred(
        edges, groups, responses, linear, psf, sharp_linear, _with_alpha_of(photo, sharp)
    )


def deblur(photo: Image, options: DeblurOptions | None = None) -> Deblurred:
    """Deblur a photo in linear light, and keep every intermediate.

    Parameters
    ----------
    photo : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        uint8, uint16, or float in [0, 1].
    options : DeblurOptions, optional
        What is known, and the methods for the rest.

    Raises
    ------
    CrfDeblurError
        The photo does not permit a step; the message says what to do.
    """
    return drain(deblurring(photo, options))


def estimating_responses(
    photo: Image, groups: Sequence[ProfileGroup], method: ResponseFit, scope: ResponseScope
) -> Job[tuple[ResponseEstimate, ...]]:
    """Long job: one response from all profiles, or one from those of each channel."""
    channels = len(planes(photo))
    if scope is ResponseScope.SHARED or channels == 1:
        return ((yield from estimating_response(groups, method)),)
    estimates = []
    for channel in range(channels):
        own = of_channel(groups, channel)
        estimates.append((yield from estimating_response(own, method)))
    return tuple(estimates)


def _edges(photo: Image, options: DeblurOptions) -> tuple[Edge, ...]:
    if isinstance(options.response, GivenResponse) and options.psf is not None:
        return ()
    extent = options.blur_extent or estimate_blur_extent(photo)
    if options.edges is not None:
        return refine_edges(photo, options.edges, blur_extent=extent)
    return find_edges(photo, blur_extent=extent)


def _psf_estimator(photo: Image, edges: Sequence[Edge], options: DeblurOptions) -> PsfEstimator:
    """Blind estimation of a PSF a little larger than the widest good edge."""
    widths = [edge.width for edge in edges if edge.good]
    extent = options.blur_extent or max(widths, default=0) or estimate_blur_extent(photo)
    # Room for what hides in the noise at both ends of an edge.
    size = 2 * round(1.15 * extent / 2 + 1) + 1
    largest = min(photo.shape[:2]) // 3
    if largest < 3:
        raise CrfDeblurError("the image is too small to find its blur; give the PSF")
    return XuJia(size=min(size, largest // 2 * 2 - 1))


def _with_alpha_of(photo: Image, colors: Image) -> Image:
    if photo.ndim == 3 and photo.shape[2] == ALPHA:
        return np.concatenate([colors, photo[..., 3:]], axis=2)
    return colors
