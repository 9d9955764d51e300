"""The whole path for a photo that is too large for it: found on a part, restored in tiles."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..deconvolution.tiles import Region
from ..errors import CrfDeblurError
from ..pipeline import (
    DEFAULT_METHOD,
    DeblurOptions,
    Intermediates,
    PhotoStack,
    Stage,
    edges_needed,
    walking,
)
from ..pipeline.intermediates import PLANE, made
from ..progress import Job
from ..psf import Beads, GivenPsf, PsfAt
from .lazy import check_blur, restore_large
from .region import informative_region, read_part
from .sources import Source

if TYPE_CHECKING:
    from dask.array import Array

GIVEN = 1024  # side of the part that is looked at if response and PSF are given


@dataclass(frozen=True, slots=True, eq=False)
class FoundInPart:
    """What was found in a part of a photo, and the whole, restored when it is asked for.

    Parameters
    ----------
    region : tuple of slice
        The part.
    have : Intermediates
        What the path has made of it, up to the PSF.
    lazy : dask array, the shape and kind of the photo
    options : DeblurOptions
        As they were used: the method is named.
    """

    region: Region
    have: Intermediates
    lazy: "Array"
    options: DeblurOptions


def deblurring_large(source: Source, options: DeblurOptions) -> Job[FoundInPart]:
    """Long job: response and PSF of the part that tells most of them, and the tiles of the whole.

    Raises
    ------
    CrfDeblurError
        Options that are not for tiles, or a photo that does not permit a stage.
    """
    _check(source, options)
    region = informative_region(source, *_sides(source, options))
    used = replace(options, method=options.method or DEFAULT_METHOD)
    have = yield from walking(Intermediates(read_part(source, region)), used, until=Stage.FIELD)
    psf = made(have.psf, "a PSF").psf
    curve, blur = made(have.response, "a response").curve, have.field or psf
    method = made(used.method, "a method")
    lazy = restore_large(source, curve, blur, method, channels=source.color, guard=options.guard)
    return FoundInPart(region, have, lazy, used)


def is_volume(options: DeblurOptions) -> bool:
    """Whether the PSF has three dimensions, so that a stack is worked on as a volume."""
    return isinstance(options.psf, GivenPsf) and options.psf.psf.ndim > PLANE


class StoredArray:
    """An open photo as dask, and the path, take arrays: only what is asked for is read.

    Parameters
    ----------
    source : Source
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self.shape, self.dtype, self.ndim = source.shape, source.dtype, len(source.shape)

    def __getitem__(self, region: tuple[slice, ...]) -> Any:
        whole = (*region, *(slice(None) for _ in self.shape[len(region) :]))
        spans = zip(whole, self.shape, strict=True)
        return self._source.read(tuple(slice(*own.indices(side)[:2]) for own, side in spans))


def stored_stack(source: Source, name: str, white: float | None = None) -> PhotoStack:
    """An open photo as the path takes stacks, read slice by slice."""
    return PhotoStack(StoredArray(source), source.color, white, name)


def _check(source: Source, options: DeblurOptions) -> None:
    if options.regions is not None and is_volume(options):
        raise CrfDeblurError(
            "parts with a PSF each are for PSFs with rows and columns only: ask for one PSF"
        )
    if options.edges is not None:
        raise CrfDeblurError(
            "edges are given for photos that are worked on as a whole; find the response on one "
            "of those, and give it"
        )
    if isinstance(options.psf, (Beads, PsfAt)):
        raise CrfDeblurError(
            "places of streaks and points are for photos that are worked on as a whole; cut one "
            "out, find the PSF on it, and give it"
        )
    if isinstance(options.psf, GivenPsf):
        check_blur(source, options.psf.psf, source.color)


def _sides(source: Source, options: DeblurOptions) -> tuple[int, ...]:
    """Rows and columns of the part that is looked at; all of them if the blur varies."""
    rows, columns = source.shape[: len(source.shape) - source.color][-2:]
    options.check_for((rows, columns), 3 if source.color else 1)
    if options.regions is not None:
        return rows, columns
    nothing = Intermediates(np.empty((0, 0)))
    return () if edges_needed(nothing, options) else (GIVEN, GIVEN)
