"""What sets the strength of a regularization, measured on samples of a large photo."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import prod
from typing import TYPE_CHECKING

import numpy as np
from array_api_compat import is_dask_array

from .. import arguments
from .._typing import BoolArray, FloatArray, Image
from ..deconvolution import PlaneStatistics, measure
from ..deconvolution.tiles import Region, Tile
from ..deconvolution.varying import JUDGED, measuring_misfit
from ..estimate import Responses, given_responses
from ..pipeline import DeblurOptions, Intermediates, Stage, walking
from ..pipeline.intermediates import made
from ..progress import Progress, drain
from ..psf import PsfField, as_psf
from ..psf.misfit import evenly, misfit
from ..response import Response, ResponseCurve
from .recipe import PsfOrField
from .sources import KINDS, Source
from .windows import pieces

if TYPE_CHECKING:
    from dask.array import Array

PATCH, PATCHES = 256, 64  # sides and number of the parts from which a photo is known
PLANE = 2  # axes


def measure_large(
    photo: "Source | Image | Array",
    curve: Response,
    *,
    channels: bool,
    psf: PsfOrField | None = None,
) -> tuple[PlaneStatistics, ...]:
    """Noise and contrast of each channel in linear light, and what the PSF leaves unexplained.

    Of photos of more than four megapixels, from patches spread evenly over all of it.

    Parameters
    ----------
    photo : Source, ndarray or dask array, shape (..., M, N) or (..., M, N, 3 or 4)
    curve : ResponseCurve or sequence of 3 of them
    channels : bool
        Whether the last axis has the colors.
    psf : ndarray, shape (H, W) or (D, H, W), or PsfField, optional
        Checked already. One of three dimensions says nothing of single slices.

    Raises
    ------
    CrfDeblurError
        Pixels that are not finite or outside [0, 1].
    """
    check_source(photo, curve)
    arguments.instance(channels, bool, "whether the last axis has the colors")
    if len(photo.shape) < PLANE + channels or 0 in photo.shape:
        raise arguments.refusal("a photo or stack with pixels", photo)
    if psf is not None and not isinstance(psf, PsfField):
        psf = as_psf(arguments.addable(psf, "a PSF"))
    response = given_responses(curve)
    parts = _parts(photo, channels)
    patches = [_Patch.of(place, part, response, channels) for place, part in parts]
    light = np.concatenate([patch.light for patch in patches])
    found = []
    for channel in range(light.shape[-1] if channels else 1):
        own = (..., channel) if channels else ...
        statistics = measure(np.ascontiguousarray(light[own]))
        planes = [replace(patch, light=patch.light[own], lost=patch.lost[own]) for patch in patches]
        found.append(replace(statistics, misfit=_unexplained(planes, psf)))
    return tuple(found)


def check_source(photo: "Source | Image | Array", curve: Response) -> None:
    """Raise ValueError unless this is a photo or stack of any kind, and its response."""
    known = isinstance(photo, (Source, np.ndarray)) or is_dask_array(photo)
    if not known or photo.dtype not in KINDS:
        raise arguments.refusal("an image of uint8, uint16 or float, a file or array of it", photo)
    if not isinstance(curve, ResponseCurve):
        arguments.instances(curve, ResponseCurve, "a response curve, or one for each channel")


@dataclass(frozen=True, slots=True, eq=False)
class _Patch:
    """A part of a slice in linear light, its rows and columns, and where it is saturated."""

    place: Region
    light: FloatArray
    lost: BoolArray

    @classmethod
    def of(cls, place: Region, part: Image, response: Responses, channels: bool) -> "_Patch":
        axes = part.ndim - channels
        have = Intermediates(part, axes=axes, response=response)
        have = drain(walking(have, DeblurOptions(), start=Stage.LINEAR, until=Stage.LINEAR))
        return cls(place, made(have.linear, "linear light"), have.clipped)


def _unexplained(patches: Sequence[_Patch], psf: PsfOrField | None) -> float | None:
    """The misfit of a PSF; of those of all parts, the median of their windows."""
    if isinstance(psf, PsfField):
        return _unexplained_by_windows(patches, psf)
    if psf is None or psf.ndim > PLANE:
        return None
    return misfit([patch.light for patch in patches], psf, [patch.lost for patch in patches])


def _unexplained_by_windows(patches: Sequence[_Patch], psfs: PsfField) -> float | None:
    every = [
        (patch, piece)
        for patch in patches
        for piece in pieces(psfs, Tile(patch.place, patch.place))
    ]
    seen = (
        (patch.light[piece.outer], psfs.at(*piece.center), patch.lost[piece.outer])
        for patch, piece in evenly(every, JUDGED)
    )
    return drain(measuring_misfit(seen, Progress("noise", 0, 1)))


def _parts(photo: "Source | Image | Array", channels: bool) -> Iterator[tuple[Region, Image]]:
    """Rows and columns, and pixels: the slices of a small photo, or patches of a large one."""
    *stack, rows, columns = photo.shape[: len(photo.shape) - channels]
    ends = tuple(slice(0, side) for side in photo.shape[len(photo.shape) - channels :])
    whole = slice(0, rows), slice(0, columns)
    if prod((*stack, rows, columns)) <= PATCHES * PATCH**2:
        for index in np.ndindex(*stack):
            yield whole, _read(photo, index, (*whole, *ends))
        return
    slices = evenly(range(prod(stack)), PATCHES)
    places = list(product(_starts(rows, len(slices)), _starts(columns, len(slices))))
    for number in slices:
        index = tuple(int(i) for i in np.unravel_index(number, stack)) if stack else ()
        for top, left in places:
            place = slice(top, min(top + PATCH, rows)), slice(left, min(left + PATCH, columns))
            yield place, _read(photo, index, (*place, *ends))


def _starts(length: int, slices: int) -> list[int]:
    """Where patches begin along an axis: at most 8 of them, less if there are many slices."""
    count = min(-(-length // PATCH), max(1, round((PATCHES / slices) ** 0.5)))
    return [int(s) for s in np.linspace(0, max(length - PATCH, 0), count)]


def _read(photo: "Source | Image | Array", index: tuple[int, ...], place: Region) -> Image:
    """Pixels of a part of one slice, without the axes of the stack."""
    region = (*(slice(i, i + 1) for i in index), *place)
    part = photo.read(region) if isinstance(photo, Source) else np.asarray(photo[region])
    return part.reshape(part.shape[len(index) :])
