"""The jobs of a session: each takes arrays and gives a record, and touches no layer."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .._typing import BoolArray, FloatArray, Image
from ..deconvolution import Deconvolver
from ..edges import Edge, Line, Rectangle, estimating_blur_extent, finding_edges, refining_edges
from ..errors import CrfDeblurError
from ..estimate import MaximumLikelihood, ResponseEstimate, ResponseFit
from ..estimate.likelihood import LiveFit
from ..io import read_photo
from ..linear import Response, clipped_pixels, clipped_share, linearizing, reapplying
from ..photo import check_photo, color
from ..pipeline import (
    DeblurOptions,
    estimating_responses,
    finding_field,
    gathering_profiles,
    measuring_psf,
    seeking_edges,
    suited_estimator,
    with_alpha_of,
)
from ..profiles import ByOrientation, ProfileGroup, of_channel, sampling_profiles
from ..progress import Job, Progress, nth
from ..psf import PsfEstimate, PsfEstimator, PsfField, RadonFit, estimating_psf
from .blurs import PLANE, Blur, axes_of, check_reach, part_of, undoing, widened
from .pixels import Region, Source
from .regions import planes_of
from .state import EdgeSet, Fitted

NO_EDGES = "there are no edges to find the PSF from; find or draw edges first"


@dataclass(frozen=True, slots=True, eq=False)
class Restoration:
    """One restored region: linear, sharp linear, and the photo in its own numbers."""

    linear: FloatArray
    sharp_linear: FloatArray
    photo: Image


@dataclass(frozen=True, slots=True, eq=False)
class Other:
    """A further photo of the same camera: a plane of a layer, or a file.

    Parameters
    ----------
    name : str
        Name of the layer, or path of the file.
    load : callable
        Gives the pixels.
    edges : tuple of Edge, optional
        If they are known; otherwise they are found automatically.
    """

    name: str
    load: Callable[[], Image]
    edges: tuple[Edge, ...] | None = None

    @classmethod
    def of_file(cls, path: Path) -> "Other":
        """A photo in a file, its edges found automatically."""
        return cls(str(path), lambda: read_photo(path))


def finding_edge_set(
    source: Source, plane: Region, extent: float | None, keep: Sequence[Edge] = ()
) -> Job[EdgeSet]:
    """Long job: straight edges of a plane beside those to keep, and their profiles."""
    photo = yield from _loading(source, plane)
    extent = extent or (yield from estimating_blur_extent(photo))
    edges = yield from finding_edges(photo, blur_extent=extent)
    return (yield from _profiled(photo, (*keep, *edges), extent, plane))


def refining_edge_set(
    source: Source,
    plane: Region,
    items: Sequence[Edge | Line | Rectangle],
    extent: float | None,
) -> Job[EdgeSet]:
    """Long job: edges as they are, and lines and rectangles refined, all in their order."""
    photo = yield from _loading(source, plane)
    extent = extent or (yield from estimating_blur_extent(photo))
    drawn = [item for item in items if not isinstance(item, Edge)]
    refined = iter((yield from refining_edges(photo, drawn, blur_extent=extent)))
    edges = tuple(item if isinstance(item, Edge) else next(refined) for item in items)
    return (yield from _profiled(photo, edges, extent, plane))


def fitting_response(
    source: Source,
    found: EdgeSet | None,
    method: ResponseFit | Sequence[ResponseFit],
    others: Sequence[Other] = (),
) -> Job[Fitted]:
    """Long job: the response from the edges of a photo, and of others of the same camera."""
    groups: list[ProfileGroup] = []
    if found is not None:
        photo = yield from _loading(source, found.plane)
        groups += yield from gathering_profiles(method, photo, found.edges)
    for index, other in enumerate(others, start=1):
        yield Progress(f"edges of {other.name}", index - 1, len(others))
        photo = other.load()
        try:
            check_photo(photo)
            edges = other.edges or (yield from seeking_edges(photo, DeblurOptions()))
            groups += yield from gathering_profiles(method, photo, edges, index)
        except CrfDeblurError as error:
            raise CrfDeblurError(f"{other.name}: {error}") from error
    estimates, fits = yield from _estimating(groups, method)
    return Fitted(estimates, tuple(groups), found, fits)


def following_edges(
    last: Fitted, edges: EdgeSet, stay: Collection[int] | None = None
) -> Job[Fitted | None]:
    """Short job: the response after a change of the edges, from the last one.

    Parameters
    ----------
    last : Fitted
        From which it goes on; the profiles of other photos stay.
    edges : EdgeSet
        The edges now.
    stay : collection of int, optional
        Numbers of the edges that count; all of them by default.

    Returns
    -------
    Fitted or None
        None if it takes a full estimate.
    """
    yield Progress("following the edges", 0, 1)
    own = edges.groups if stay is None else _only(edges.groups, stay)
    groups = (*own, *(group for group in last.groups if group.sources[0].image > 0))
    parts = _split(groups, len(last.fits))
    fits = [fit.refit(part) for fit, part in zip(last.fits, parts, strict=True)]
    found = tuple(fit for fit in fits if fit is not None)
    if len(found) < len(fits) or not found:
        return None
    return Fitted(tuple(fit.estimate for fit in found), groups, edges, found)


def linearizing_region(source: Source, region: Region, curve: Response) -> Job[FloatArray]:
    """Long job: a region in linear light, (..., M, N) or (..., M, N, 3), plane by plane."""
    linear: FloatArray | None = None
    planes = list(planes_of(region))
    for done, plane in enumerate(planes):
        photo = source.photo(plane)
        check_photo(photo)
        light = yield from nth(linearizing(color(photo), curve), done, len(planes), "slice")
        if linear is None:
            linear = np.empty((len(planes), *light.shape), dtype=light.dtype)
        linear[done] = light
    return _stacked(linear, region)


def seeking_psf(
    source: Source,
    region: Region,
    curve: Response,
    method: PsfEstimator | RadonFit | None = None,
    *,
    found: EdgeSet | None = None,
    extent: float | None = None,
) -> Job[PsfEstimate]:
    """Long job: the PSF of a plane or a part of it; its size is judged if no method is given.

    Parameters
    ----------
    source, region : Source and tuple of slice
        Where it is looked for; what is found from edges alone is that of their whole plane.
    curve : ResponseCurve or sequence of 3 of them
        Response of the camera.
    method : PsfEstimator or RadonFit, optional
        By default the one that suits the blur.
    found : EdgeSet, optional
        Edges of the photo.
    extent : float, optional
        Width in pixels of a blurred edge; by default the size of the PSF is found with it.

    Raises
    ------
    CrfDeblurError
        The method needs edges, and there are none.
    """
    if isinstance(method, RadonFit):
        if found is None:
            raise CrfDeblurError(NO_EDGES)
        whole = yield from _loading(source, found.plane)
        return (yield from measuring_psf(whole, found.edges, curve, method))
    photo = yield from _loading(source, region)
    linear = yield from linearizing(color(photo), curve)
    method = method or suited_estimator(linear, extent)
    return (yield from estimating_psf(linear, method, clipped=clipped_pixels(color(photo))))


def seeking_field(
    source: Source,
    plane: Region,
    curve: Response,
    method: PsfEstimator | RadonFit | None,
    whole: PsfEstimate,
    *,
    regions: int | tuple[int, int] | None,
    extent: float | None = None,
) -> Job[PsfField | None]:
    """Long job: the PSFs of the parts of a plane, if it is to be divided.

    Parameters
    ----------
    source, plane : Source and tuple of slice
        Where they are looked for; all rows and columns.
    curve, method, extent
        As for :func:`seeking_psf`.
    whole : PsfEstimate
        What that has found.
    regions : int or (int, int) or None
        As of :class:`~napari_crfdeblur.pipeline.DeblurOptions`.
    """
    if regions is None:
        return None
    photo = color((yield from _loading(source, plane)))
    linear = yield from linearizing(photo, curve)
    options = DeblurOptions(psf=method, blur_extent=extent, regions=regions)
    return (yield from finding_field(linear, whole, options, clipped_pixels(photo)))


def sharpening(
    source: Source, linear: FloatArray, region: Region, blur: Blur, method: Deconvolver
) -> Job[FloatArray]:
    """Long job: a linear region deconvolved, plane by plane or volume by volume.

    Where the camera saturated, which the pixels of `source` tell, the light can be more.
    """
    check_reach(blur, source, region)
    sharp, axes, own = np.empty_like(linear), axes_of(blur), part_of(blur, region)
    stack = list(np.ndindex(linear.shape[: len(region) - axes]))
    kind = "slice" if axes == PLANE else "volume"
    for done, index in enumerate(stack):
        clipped = _clipped(source, _piece(region, index))
        job = undoing(linear[index], own, method, clipped.reshape(linear[index].shape))
        sharp[index] = yield from nth(job, done, len(stack), kind)
    return sharp


def recording(source: Source, region: Region, sharp: FloatArray, curve: Response) -> Job[Image]:
    """Long job: the response applied again, in the numbers of the photo, alpha kept."""
    planes = list(planes_of(region))
    stack = sharp.shape[: len(region) - 2]
    photos: Image | None = None
    for done, (plane, index) in enumerate(zip(planes, np.ndindex(stack), strict=True)):
        photo = source.photo(plane)
        job = reapplying(sharp[index], curve, photo.dtype)
        recorded = with_alpha_of(photo, (yield from nth(job, done, len(planes), "slice")))
        recorded = source.recorded(recorded)
        if photos is None:
            photos = np.empty((len(planes), *recorded.shape), dtype=recorded.dtype)
        photos[done] = recorded
    return _stacked(photos, region)


def restoring(
    source: Source, region: Region, curve: Response, blur: Blur, method: Deconvolver
) -> Job[Restoration]:
    """Long job: the second half of the path for a region."""
    check_reach(blur, source, region)
    linear = yield from linearizing_region(source, region, curve)
    sharp = yield from sharpening(source, linear, region, blur, method)
    photo = yield from recording(source, region, sharp, curve)
    return Restoration(linear, sharp, photo)


def counting_clipped(sharp: FloatArray) -> Job[float]:
    """Long job: share of the deconvolved values that are lost when the response is applied."""
    yield Progress("counting clipped values", 0, 1)
    return clipped_share(sharp)


def previewing(
    source: Source, region: Region, curve: Response, blur: Blur, method: Deconvolver
) -> Job[Image]:
    """Long job: a region restored with a margin, so that its borders are those of the whole."""
    wide = widened(region, blur, source)
    whole = yield from restoring(source, wide, curve, blur, method)
    inner = tuple(
        slice(part.start - outer.start, part.stop - outer.start)
        for part, outer in zip(region, wide, strict=True)
    )
    return np.ascontiguousarray(whole.photo[inner])


def _estimating(
    groups: Sequence[ProfileGroup], method: ResponseFit | Sequence[ResponseFit]
) -> Job[tuple[tuple[ResponseEstimate, ...], tuple[LiveFit, ...]]]:
    """The estimates of all channels or of each, and their fits if all can follow the edges."""
    methods = [method] if isinstance(method, ResponseFit) else method
    able = [own for own in methods if isinstance(own, MaximumLikelihood)]
    if len(able) < len(methods):
        return (yield from estimating_responses(groups, method)), ()
    fits = []
    for own, part in zip(able, _split(groups, len(able)), strict=True):
        fits.append((yield from own.fitting(part)))
    return tuple(fit.estimate for fit in fits), tuple(fits)


def _split(groups: Sequence[ProfileGroup], count: int) -> list[Sequence[ProfileGroup]]:
    """The profiles for one response of all channels, or for that of each."""
    return [groups] if count == 1 else [of_channel(groups, c) for c in range(count)]


def _only(groups: Sequence[ProfileGroup], stay: Collection[int]) -> tuple[ProfileGroup, ...]:
    """The profiles of some edges; groups left empty are dropped."""
    masks = [[source.edge in stay for source in group.sources] for group in groups]
    return tuple(
        g.select(np.array(mask)) for g, mask in zip(groups, masks, strict=True) if any(mask)
    )


def _loading(source: Source, plane: Region) -> Job[Image]:
    yield Progress("reading the photo", 0, 1)
    photo = source.photo(plane)
    check_photo(photo)
    return photo


def _profiled(photo: Image, edges: Sequence[Edge], extent: float, plane: Region) -> Job[EdgeSet]:
    groups = yield from sampling_profiles(photo, edges, grouping=ByOrientation())
    return EdgeSet(tuple(edges), tuple(groups), extent, plane)


def _clipped(source: Source, region: Region) -> BoolArray:
    """Where the camera saturated, plane by plane: shape (P, M, N) or (P, M, N, 3)."""
    return np.stack([clipped_pixels(color(source.photo(plane))) for plane in planes_of(region)])


def _piece(region: Region, index: Sequence[int]) -> Region:
    """The part of a region with this index over its first axes."""
    starts = [axis.start + i for axis, i in zip(region, index, strict=False)]
    return (*(slice(start, start + 1) for start in starts), *region[len(index) :])


def _stacked(planes: Image | None, region: Region) -> Image:
    if planes is None:
        raise CrfDeblurError("the stack has no slices: choose another layer")
    stack = [axis.stop - axis.start for axis in region[:-2]]
    return planes.reshape(*stack, *planes.shape[1:])
