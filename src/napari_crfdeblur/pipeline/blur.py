"""The blur of a photo or a stack: a PSF of slices or of volumes, or the PSFs of all parts."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from .._typing import FloatArray
from ..deconvolution.tiles import Region
from ..errors import CrfDeblurError
from ..psf import PsfField
from .intermediates import PLANE

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


def widened(region: Region, blur: Blur, shape: Sequence[int]) -> Region:
    """A region with one side of the PSF around it: so far its light went, and some more."""
    sides = _sides(blur)
    margins = (0,) * (len(region) - len(sides)) + sides
    return tuple(
        slice(max(part.start - margin, 0), min(part.stop + margin, side))
        for part, margin, side in zip(region, margins, shape, strict=True)
    )


def check_fit(blur: Blur, shape: Sequence[int], name: str) -> None:
    """Refuse a blur that cannot be that of a photo.

    Parameters
    ----------
    blur : ndarray or PsfField
    shape : sequence of int
        Of the photo or stack, color left out.
    name : str
        Of the photo, for the message.

    Raises
    ------
    CrfDeblurError
        A volume for a single picture, or the PSFs of the parts of a picture of other sides.
    """
    if isinstance(blur, PsfField):
        if blur.shape != tuple(shape[-2:]):
            raise CrfDeblurError(
                f"these are the PSFs of the parts of a picture of {_times(blur.shape)} pixels, but "
                f"“{name}” has {_times(shape[-2:])}: estimate its own"
            )
    elif blur.ndim > len(shape):
        raise CrfDeblurError(
            f"the PSF has 3 dimensions, {_times(blur.shape)}, but “{name}” is a single "
            "picture: give a PSF with rows and columns, or choose a stack"
        )


def check_reach(blur: Blur, shape: Sequence[int], region: Region, name: str) -> None:
    """Refuse a region with fewer slices than a PSF of volumes has.

    Raises
    ------
    CrfDeblurError
        As of :func:`check_fit`, or too few slices.
    """
    check_fit(blur, shape, name)
    if axes_of(blur) == PLANE:
        return
    slices, depth = region[-3], _sides(blur)[0]
    if slices.stop - slices.start < depth:
        raise CrfDeblurError(
            f"the PSF reaches over {depth} slices, of which there are "
            f"{slices.stop - slices.start}: restore all of the stack, or give a PSF of fewer slices"
        )


def _sides(blur: Blur) -> tuple[int, ...]:
    return tuple((blur.psfs[0, 0] if isinstance(blur, PsfField) else blur).shape)


def _times(shape: Sequence[int]) -> str:
    """Sides as a user gives them: width first."""
    return " x ".join(str(side) for side in reversed(shape))
