"""Jobs that find edges, response and blur: they take arrays, give a record, and touch no layer."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..._typing import Image
from ...edges import Edge, Line, Rectangle, estimating_blur_extent, finding_edges, refining_edges
from ...errors import CrfDeblurError
from ...estimate import MaximumLikelihood, ResponseEstimate, ResponseFit
from ...estimate.likelihood import LiveFit
from ...io import read_photo
from ...photo import check_photo, color
from ...pipeline import (
    DeblurOptions,
    estimating_responses,
    finding_field,
    gathering_profiles,
    measuring_psf,
    seeking_edges,
    suited_estimator,
)
from ...profiles import ByOrientation, ProfileGroup, of_channel, sampling_profiles
from ...progress import Job, Progress
from ...psf import PsfEstimate, PsfEstimator, PsfField, RadonFit, estimating_psf
from ...response import Response, clipped_pixels, linearizing
from ..pixels import Region, Source
from ..state import EdgeSet, Fitted

NO_EDGES = "there are no edges to find the PSF from; find or draw edges first"


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
