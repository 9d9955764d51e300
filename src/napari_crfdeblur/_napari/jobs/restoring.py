"""Jobs that restore photos: they take arrays, give a record, and touch no layer."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from ..._typing import BoolArray, FloatArray, Image
from ...deconvolution import Deconvolver
from ...errors import CrfDeblurError
from ...photo import check_photo, color
from ...pipeline import with_alpha_of
from ...progress import Job, Progress, nth
from ...response import Response, clipped_pixels, clipped_share, linearizing, reapplying
from ..blurs import PLANE, Blur, axes_of, check_reach, part_of, undoing, widened
from ..pixels import Region, Source
from ..regions import planes_of


@dataclass(frozen=True, slots=True, eq=False)
class Restoration:
    """One restored region: linear, sharp linear, and the photo in its own numbers."""

    linear: FloatArray
    sharp_linear: FloatArray
    photo: Image


def linearizing_region(source: Source, region: Region, curve: Response) -> Job[FloatArray]:
    """Long job: a region in linear light, (..., M, N) or (..., M, N, 3), plane by plane."""
    jobs = (_linearizing_plane(source, plane, curve) for plane in planes_of(region))
    return (yield from _stacking(jobs, region))


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
    stack = np.ndindex(sharp.shape[: len(region) - 2])
    jobs = (
        _recording_plane(source, plane, sharp[index], curve)
        for plane, index in zip(planes_of(region), stack, strict=True)
    )
    return (yield from _stacking(jobs, region))


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


def _linearizing_plane(source: Source, plane: Region, curve: Response) -> Job[FloatArray]:
    photo = source.photo(plane)
    check_photo(photo)
    return (yield from linearizing(color(photo), curve))


def _recording_plane(
    source: Source, plane: Region, sharp: FloatArray, curve: Response
) -> Job[Image]:
    photo = source.photo(plane)
    recorded = yield from reapplying(sharp, curve, photo.dtype)
    return source.recorded(with_alpha_of(photo, recorded))


def _clipped(source: Source, region: Region) -> BoolArray:
    """Where the camera saturated, plane by plane: shape (P, M, N) or (P, M, N, 3)."""
    return np.stack([clipped_pixels(color(source.photo(plane))) for plane in planes_of(region)])


def _piece(region: Region, index: Sequence[int]) -> Region:
    """The part of a region with this index over its first axes."""
    starts = [axis.start + i for axis, i in zip(region, index, strict=False)]
    return (*(slice(start, start + 1) for start in starts), *region[len(index) :])


def _stacking(jobs: Iterable[Job[Image]], region: Region) -> Job[Image]:
    """Long job: what the jobs of all planes of a region give, as one array of its shape."""
    stack = [axis.stop - axis.start for axis in region[:-2]]
    planes: Image | None = None
    for done, job in enumerate(jobs):
        plane = yield from nth(job, done, prod(stack), "slice")
        if planes is None:
            planes = np.empty((prod(stack), *plane.shape), dtype=plane.dtype)
        planes[done] = plane
    if planes is None:
        raise CrfDeblurError("the stack has no slices: choose another layer")
    return planes.reshape(*stack, *planes.shape[1:])
