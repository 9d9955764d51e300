"""The whole path: photo -> edges -> profiles -> response -> linear -> PSF -> sharp photo."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import radians

import numpy as np

from ._typing import BoolArray, FloatArray, Image
from .deconvolution import Deconvolver, LocalShrinkage, deconvolving
from .deconvolution.varying import deconvolving_varying
from .edges import (
    Edge,
    Line,
    Rectangle,
    estimating_blur_extent,
    finding_edges,
    refining_edges,
)
from .errors import CrfDeblurError
from .estimate import (
    GivenResponse,
    MaximumLikelihood,
    ResponseEstimate,
    ResponseFit,
    estimating_response,
)
from .estimate.identifiability import LEAST_COLLINEARITY, levels_apart
from .photo import ALPHA, check_photo, color, planes
from .profiles import ByEdge, ByOrientation, ProfileGroup, of_channel, sampling_profiles
from .progress import Job, drain
from .psf import (
    GivenPsf,
    PsfEstimate,
    PsfEstimator,
    PsfField,
    RadonFit,
    Variational,
    estimating_psf,
    estimating_psf_field,
    estimating_psf_from_profiles,
)
from .response import Response, clipped_pixels, clipped_share, dorf_mean, linearizing, reapplying

DEFAULT_METHOD: Deconvolver = LocalShrinkage()  # the best on photos
# A PSF of 20 pixels looks alike along normals this near each other, to a sixth of a pixel.
NARROW = ByOrientation(tolerance=radians(1))


@dataclass(frozen=True, slots=True)
class DeblurOptions:
    """How a photo is deblurred; the defaults do everything from the photo itself.

    Parameters
    ----------
    response : ResponseFit or sequence of 3 of them
        How the response of all channels is found, or that of each; if it is known,
        :class:`~.estimate.GivenResponse`.
    edges : sequence of Line or Rectangle, optional
        Edges drawn by the user; found automatically if not given.
    blur_extent : float, optional
        Largest width of a blurred edge in pixels; judged from the photo if not given.
    psf : PsfEstimator or RadonFit, optional
        How the PSF is found; by default :class:`~.psf.Variational`, or
        :class:`~.psf.GivenPsf` if it is known. :class:`~.psf.RadonFit` finds it from the
        straight edges alone.
    method : Deconvolver, optional
        How the blur is undone; by default :class:`~.deconvolution.LocalShrinkage`.
    regions : int or (int, int), optional
        Rows and columns of parts of the photo, or parts along its longer side, each of which
        gets a PSF of its own; by default one PSF serves the whole photo.
    """

    response: ResponseFit | Sequence[ResponseFit] = field(default_factory=MaximumLikelihood)
    edges: Sequence[Line | Rectangle] | None = None
    blur_extent: float | None = None
    psf: PsfEstimator | RadonFit | None = None
    method: Deconvolver | None = None
    regions: int | tuple[int, int] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class FoundBlur:
    """The first half of the path: what the photo says of the response and the blur.

    Parameters
    ----------
    edges, groups, responses, linear, psf, field
        As in :class:`Deblurred`.
    clipped : ndarray of bool, the shape of `linear`
        True where the camera saturated.
    """

    edges: tuple[Edge, ...]
    groups: tuple[ProfileGroup, ...]
    responses: tuple[ResponseEstimate, ...]
    linear: FloatArray
    psf: PsfEstimate
    clipped: BoolArray
    field: PsfField | None = None


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
    field : PsfField, optional
        The PSFs of all parts, if each had its own.
    """

    edges: tuple[Edge, ...]
    groups: tuple[ProfileGroup, ...]
    responses: tuple[ResponseEstimate, ...]
    linear: FloatArray
    psf: PsfEstimate
    sharp_linear: FloatArray
    photo: Image
    field: PsfField | None = None

    @property
    def clipped(self) -> float:
        """Share of the deconvolved values outside [0, 1], lost when the response is applied."""
        return clipped_share(self.sharp_linear)


def finding_blur(photo: Image, options: DeblurOptions) -> Job[FoundBlur]:
    """Long job: the path up to the PSF."""
    check_photo(photo)
    edges: tuple[Edge, ...] = ()
    extent = options.blur_extent
    if edges_needed(options):
        extent = extent or (yield from estimating_blur_extent(photo))
        edges = yield from seeking_edges(photo, replace(options, blur_extent=extent))
    groups = yield from gathering_profiles(options.response, photo, edges)
    responses = yield from estimating_responses(groups, options.response)
    linear = yield from linearizing(color(photo), joint_curve(responses))
    clipped = clipped_pixels(color(photo))
    estimator = options.psf or suited_estimator(photo, options.blur_extent)
    if isinstance(estimator, RadonFit):
        psf = yield from measuring_psf(photo, edges, joint_curve(responses), estimator)
    else:
        psf = yield from estimating_psf(linear, estimator, clipped=clipped)
    field = yield from finding_field(linear, psf, options, clipped)
    return FoundBlur(edges, groups, responses, linear, psf, clipped, field)


def finding_field(
    linear: FloatArray, psf: PsfEstimate, options: DeblurOptions, clipped: BoolArray | None = None
) -> Job[PsfField | None]:
    """Long job: the PSFs of the parts of a photo, if it is to be divided.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, 3)
        Relative irradiance.
    psf : PsfEstimate
        That of the whole.
    options : DeblurOptions
        `regions`, and the blind estimator for the parts; the default one if `psf` is found
        otherwise.
    clipped : ndarray of bool, the shape of `linear`, optional
        True where the camera saturated.
    """
    if options.regions is None:
        return None
    method = options.psf
    if method is None or isinstance(method, RadonFit | GivenPsf):
        method = suited_estimator(linear, options.blur_extent)
    return (
        yield from estimating_psf_field(linear, method, psf, grid=options.regions, clipped=clipped)
    )


def undoing_blur(found: FoundBlur, method: Deconvolver) -> Job[FloatArray]:
    """Long job: deconvolve with the PSF of the whole, or with those of the parts."""
    if found.field is None:
        return (yield from deconvolving(found.linear, found.psf.psf, method, clipped=found.clipped))
    return (
        yield from deconvolving_varying(found.linear, found.field, method, clipped=found.clipped)
    )


def deblurring(photo: Image, options: DeblurOptions | None = None) -> Job[Deblurred]:
    """Job of :func:`deblur`: reports progress, can be stopped."""
    options = options or DeblurOptions()
    found = yield from finding_blur(photo, options)
    method = options.method or DEFAULT_METHOD
    sharp_linear = yield from undoing_blur(found, method)
    curve = joint_curve(found.responses)
    sharp = yield from reapplying(sharp_linear, curve, photo.dtype)
    return Deblurred(
        edges=found.edges,
        groups=found.groups,
        responses=found.responses,
        linear=found.linear,
        psf=found.psf,
        sharp_linear=sharp_linear,
        photo=with_alpha_of(photo, sharp),
        field=found.field,
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
    groups: Sequence[ProfileGroup], method: ResponseFit | Sequence[ResponseFit]
) -> Job[tuple[ResponseEstimate, ...]]:
    """Long job: one response from all profiles, or one from those of each channel."""
    if isinstance(method, ResponseFit):
        return ((yield from estimating_response(groups, method)),)
    estimates = []
    for channel, own in enumerate(method):
        estimates.append((yield from estimating_response(of_channel(groups, channel), own)))
    return tuple(estimates)


def joint_curve(estimates: Sequence[ResponseEstimate]) -> Response:
    """The curve of all channels, or the curves of each."""
    curves = [estimate.curve for estimate in estimates]
    return curves[0] if len(curves) == 1 else curves


def profiles_for(
    method: ResponseFit | Sequence[ResponseFit],
    photo: Image,
    edges: Sequence[Edge],
    index: int = 0,
) -> tuple[ProfileGroup, ...]:
    """Profiles of a photo, in the groups that tell the method most about the response.

    Those of one orientation are a group. For the paper's methods, which do not allow for edges
    that lie a little beside where they were located, the channels of each edge are a group of
    their own where edges lie between different colors and one response serves all channels.
    """
    return drain(gathering_profiles(method, photo, edges, index))


def gathering_profiles(
    method: ResponseFit | Sequence[ResponseFit],
    photo: Image,
    edges: Sequence[Edge],
    index: int = 0,
) -> Job[tuple[ProfileGroup, ...]]:
    """Job of :func:`profiles_for`: reports progress, can be stopped."""
    if not isinstance(method, ResponseFit) and len(method) != len(planes(photo)):
        raise CrfDeblurError(
            f"{len(method)} responses do not fit the {len(planes(photo))} channels of the photo; "
            "use one response for all"
        )
    groups = yield from sampling_profiles(photo, edges, grouping=ByOrientation(), index=index)
    if isinstance(method, ResponseFit) and not isinstance(method, MaximumLikelihood):
        by_edge = [own for group in groups for own in ByEdge().split(group)]
        rows = [group for group in by_edge if len(group) >= 2]
        if levels_apart(rows, dorf_mean()) >= LEAST_COLLINEARITY:
            return tuple(sorted(by_edge, key=len, reverse=True))
    return tuple(groups)


def measuring_psf(
    photo: Image, edges: Sequence[Edge], curve: Response, method: RadonFit
) -> Job[PsfEstimate]:
    """Long job: the PSF from the straight edges of a photo, given its response."""
    narrow = yield from sampling_profiles(color(photo), edges, grouping=NARROW)
    return (yield from estimating_psf_from_profiles(narrow, curve, method))


def seeking_edges(photo: Image, options: DeblurOptions) -> Job[tuple[Edge, ...]]:
    """Long job: the edges of a photo, found or drawn, good and bad."""
    extent = options.blur_extent or (yield from estimating_blur_extent(photo))
    if options.edges is not None:
        return (yield from refining_edges(photo, options.edges, blur_extent=extent))
    return (yield from finding_edges(photo, blur_extent=extent))


def edges_needed(options: DeblurOptions) -> bool:
    """Whether the path has to look for edges: for the response, or for a PSF from them alone."""
    methods = [options.response] if isinstance(options.response, ResponseFit) else options.response
    return isinstance(options.psf, RadonFit) or not all(
        isinstance(m, GivenResponse) for m in methods
    )


def suited_estimator(photo: Image, extent: float | None) -> PsfEstimator:
    """Blind estimation of a PSF of unknown size, or of one a little larger than a known blur.

    Parameters
    ----------
    photo : ndarray, shape (M, N) or (M, N, C)
        Photo or linear image: how large a PSF it permits.
    extent : float, optional
        Largest width of a blurred edge in pixels.
    """
    largest = min(photo.shape[:2]) // 3
    if largest < 3:
        raise CrfDeblurError("the image is too small to find its blur; give the PSF")
    if extent is None:
        return Variational()
    # Room for what hides in the noise at both ends of an edge.
    size = 2 * round(1.15 * extent / 2 + 1) + 1
    return Variational(size=min(size, (largest - 1) // 2 * 2 + 1))


def with_alpha_of(photo: Image, colors: Image) -> Image:
    """The colors with the alpha channel of the photo, if it has one."""
    if photo.ndim == 3 and photo.shape[2] == ALPHA:
        return np.concatenate([colors, photo[..., 3:]], axis=2)
    return colors
