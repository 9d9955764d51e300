"""The blur as jobs work with it: a PSF of slices or of volumes, or the PSFs of all parts."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from .._typing import BoolArray, FloatArray
from ..deconvolution import Deconvolver, deconvolving
from ..deconvolution.varying import deconvolving_varying
from ..errors import CrfDeblurError
from ..progress import Job
from ..psf import PsfField
from ..report import draw_psf
from ..report.pictures import draw_psf_field
from .pixels import Region, Source

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PLANE = 2  # axes of a slice

Blur: TypeAlias = FloatArray | PsfField
"""A PSF, shape (H, W) for slices or (D, H, W) for volumes; or those of all parts of a slice."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PartOfField(PsfField):
    """The PSFs of a part of a picture: those of the whole, by places in the part.

    Parameters
    ----------
    whole : PsfField
        Of the whole picture.
    corner : (int, int)
        First row and column of the part; `shape` is that of the part.
    """

    whole: PsfField
    corner: tuple[int, int]

    @property
    def pace(self) -> tuple[float, float]:
        """As in the whole."""
        return self.whole.pace

    def at(self, row: float, column: float) -> FloatArray:
        """The PSF at a place of the part, shape (H, W)."""
        return self.whole.at(self.corner[0] + row, self.corner[1] + column)


def axes_of(blur: Blur) -> int:
    """Number of axes along which it blurs: 2, or 3 for volumes."""
    return len(_sides(blur))


def part_of(blur: Blur, region: Region) -> Blur:
    """The blur of a region of a photo."""
    if not isinstance(blur, PsfField):
        return blur
    rows, columns = region[-2:]
    return PartOfField(
        blur.psfs,
        blur.statuses,
        (rows.stop - rows.start, columns.stop - columns.start),
        whole=blur,
        corner=(rows.start, columns.start),
    )


def widened(region: Region, blur: Blur, source: Source) -> Region:
    """A region with one side of the PSF around it: so far its light went, and some more."""
    sides = _sides(blur)
    margins = (0,) * (len(region) - len(sides)) + sides
    return tuple(
        slice(max(part.start - margin, 0), min(part.stop + margin, side))
        for part, margin, side in zip(region, margins, source.shape, strict=True)
    )


def undoing(
    linear: FloatArray, blur: Blur, method: Deconvolver, clipped: BoolArray
) -> Job[FloatArray]:
    """Long job: one slice, or one volume, deconvolved."""
    if isinstance(blur, PsfField):
        return deconvolving_varying(linear, blur, method, clipped=clipped)
    return deconvolving(linear, blur, method, clipped=clipped)


def check_fit(blur: Blur, source: Source) -> None:
    """Refuse a blur that cannot be that of a photo.

    Raises
    ------
    CrfDeblurError
        A volume for a single picture, or the PSFs of the parts of a picture of other sides.
    """
    if isinstance(blur, PsfField):
        if blur.shape != source.shape[-2:]:
            raise CrfDeblurError(
                f"these are the PSFs of the parts of a picture of {_times(blur.shape)} pixels, but "
                f"“{source.name}” has {_times(source.shape[-2:])}: estimate its own"
            )
    elif blur.ndim > len(source.shape):
        raise CrfDeblurError(
            f"the PSF has 3 dimensions, {_times(blur.shape)}, but “{source.name}” is a single "
            "picture: give a PSF with rows and columns, or choose a stack"
        )


def check_reach(blur: Blur, source: Source, region: Region) -> None:
    """Refuse a region with fewer slices than a PSF of volumes has.

    Raises
    ------
    CrfDeblurError
        As of :func:`check_fit`, or too few slices.
    """
    check_fit(blur, source)
    if axes_of(blur) == PLANE:
        return
    slices, depth = region[-3], _sides(blur)[0]
    if slices.stop - slices.start < depth:
        raise CrfDeblurError(
            f"the PSF reaches over {depth} slices, of which there are "
            f"{slices.stop - slices.start}: restore all of the stack, or give a PSF of fewer slices"
        )


def seen(psf: FloatArray) -> FloatArray:
    """A PSF as a picture, shape (H, W): that of volumes as it is seen along the first axis."""
    return psf if psf.ndim == PLANE else np.asarray(psf.sum(axis=0))


def draw_blur(ax: "Axes", blur: Blur) -> None:
    """Draw a PSF, or the map of those of all parts."""
    if isinstance(blur, PsfField):
        draw_psf_field(ax, blur)
    else:
        draw_psf(ax, seen(blur))


def _sides(blur: Blur) -> tuple[int, ...]:
    return tuple((blur.psfs[0, 0] if isinstance(blur, PsfField) else blur).shape)


def _times(shape: tuple[int, ...]) -> str:
    """Sides as a user gives them: width first."""
    return " x ".join(str(side) for side in reversed(shape))
