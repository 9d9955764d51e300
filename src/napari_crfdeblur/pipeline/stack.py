"""The path on a photo or a stack of photos: found on one slice, restored on all."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from .. import arguments
from .._typing import FloatArray, Image
from ..deconvolution import Trust
from ..deconvolution.tiles import Region
from ..errors import CrfDeblurError
from ..estimate import Responses
from ..photo import from_unit
from ..progress import Job, nth
from ..psf import PsfEstimate, PsfField, PsfStatus
from .blur import Blur, axes_of, check_reach, part_of
from .intermediates import PLANE, Intermediates
from .options import DeblurOptions
from .path import Stage, walking
from .trial import LightTrial

TRUST = ("kept", "error", "believed")
MOST_WHITE = 1e20  # and 1 over it: what is divided by it stays within single precision


@dataclass(frozen=True, slots=True, eq=False)
class PhotoStack:
    """The pixels of a photo or of a stack of photos, as they are now; safe in any thread.

    Parameters
    ----------
    data : array_like, shape (..., M, N) or (..., M, N, C)
        A numpy array, a dask array or anything else that gives parts of itself.
    rgb : bool
        Whether the last axis holds colors.
    white : float, optional
        Value that stands for intensity 1; by default the full scale of the kind of number.
    name : str
        For messages.
    """

    data: Any
    rgb: bool
    white: float | None = None
    name: str = "the photo"

    def __post_init__(self) -> None:
        what = "a photo or a stack that has a shape, a kind of real number, and parts"
        if not all(hasattr(self.data, name) for name in ("shape", "ndim", "dtype", "__getitem__")):
            raise arguments.refusal(what, self.data)
        arguments.instance(self.rgb, bool, "whether the last axis holds colors")
        real = arguments.kind_of(self.data).startswith(arguments.REAL)
        if not real or self.data.ndim < PLANE + self.rgb:
            raise arguments.refusal(what, self.data)
        if self.white is not None:
            arguments.number(self.white, "a white level", least=1 / MOST_WHITE, most=MOST_WHITE)
        arguments.instance(self.name, str, "a name")

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape without the color axis."""
        return tuple(self.data.shape[: self.data.ndim - self.rgb])

    @property
    def dtype(self) -> np.dtype[Any]:
        """Kind of number of the pixels, and of what is given back."""
        dtype: np.dtype[Any] = np.dtype(self.data.dtype)
        return dtype

    @property
    def whole(self) -> Region:
        """All of it."""
        return tuple(slice(0, side) for side in self.shape)

    def photo(self, region: Region, axes: int = PLANE) -> Image:
        """One plane, or a volume of 3 `axes`, or a part of it, with the colors last."""
        pixels = np.asarray(self.data[region])
        if pixels.dtype != self.dtype:
            raise CrfDeblurError(
                f"“{self.name}” says that it holds {self.dtype}, but this slice is "
                f"{pixels.dtype}; convert all slices to one kind of number"
            )
        pixels = pixels.reshape(pixels.shape[len(self.shape) - axes :])
        return self.in_unit(pixels)

    def in_unit(self, pixels: Image) -> Image:
        """Pixels with the white level at 1; without one, as they are."""
        if self.white is None:
            return pixels
        return np.clip(pixels / np.float32(self.white), 0, 1).astype(np.float32, copy=False)

    def recorded(self, photo: Image) -> Image:
        """A photo in the stack's own numbers: the way back of :meth:`photo`."""
        if self.white is None:
            return photo.astype(self.dtype, copy=False)
        values = from_unit(photo, np.float32) * np.float32(self.white)
        if self.dtype.kind in "iu":
            values = np.rint(values)
        return values.astype(self.dtype)


@dataclass(frozen=True, slots=True, eq=False)
class Restored:
    """One region after the second half of the path; None for stages that were not reached.

    Parameters
    ----------
    linear, sharp_linear : ndarray, shape (..., M, N) or (..., M, N, 3)
        Relative irradiance before and after deconvolution.
    photo : ndarray, shape (..., M, N) or (..., M, N, C)
        In the numbers of the stack, alpha kept.
    trust : Trust
        How far the light can be believed.
    """

    linear: FloatArray | None = None
    sharp_linear: FloatArray | None = None
    photo: Image | None = None
    trust: Trust | None = None


def restoring_stack(
    stack: PhotoStack,
    region: Region,
    response: Responses,
    blur: Blur | None,
    options: DeblurOptions,
    *,
    start: Restored | None = None,
    until: Stage = Stage.REAPPLY,
) -> Job[Restored]:
    """Long job: the second half of the path for a region, plane by plane or volume by volume.

    Parameters
    ----------
    stack : PhotoStack
    region : tuple of slice
        One for each axis of the stack.
    response : Responses
    blur : ndarray or PsfField or None
        A PSF of slices, one of volumes, or those of all parts; None if `until` needs none.
    options : DeblurOptions
        Its `method`.
    start : Restored, optional
        What there is of the region already, so that earlier stages are passed over.
    until : Stage
        ``LINEAR``, ``RESTORE`` or ``REAPPLY``.

    Raises
    ------
    CrfDeblurError
        The PSF does not fit the stack, or pixels are no intensities.
    """
    axes = PLANE
    if blur is not None:
        check_reach(blur, stack.shape, region, stack.name)
        axes = axes_of(blur)
    known, parts = start or Restored(), list(stack_pieces(region, axes))
    first = Stage.LINEAR if known.linear is None else Stage.RESTORE
    first = first if known.sharp_linear is None else Stage.REAPPLY
    lead = tuple(axis.stop - axis.start for axis in region[: len(region) - axes])
    made: dict[str, Image] = {}
    for done, (index, piece) in enumerate(parts):
        have = Intermediates(
            stack.photo(piece, axes),
            axes=axes,
            response=response,
            trial=LightTrial(),  # the response is settled
            linear=None if known.linear is None else known.linear[index],
            sharp_linear=None if known.sharp_linear is None else known.sharp_linear[index],
        )
        if blur is not None:
            have = _blurred(have, part_of(blur, region))
        kind = "slice" if axes == PLANE else "volume"
        have = yield from nth(
            walking(have, options, start=first, until=until), done, len(parts), kind
        )
        if have.result is not None:
            have = replace(have, result=stack.recorded(have.result))
        _put(made, lead, index, have)
    if not parts:
        raise CrfDeblurError("the stack has no slices: choose another layer")
    trust = Trust(*(made[name] for name in TRUST)) if TRUST[0] in made else None
    return Restored(made.get("linear"), made.get("sharp_linear"), made.get("result"), trust)


def planes_of(region: Region) -> Iterator[Region]:
    """The region plane by plane: slices of length 1 on all axes but rows and columns."""
    return (piece for _, piece in stack_pieces(region, PLANE))


def stack_pieces(region: Region, axes: int) -> Iterator[tuple[tuple[int, ...], Region]]:
    """The region piece by piece: the index of each over the first axes, and where it lies."""
    lead, inner = region[: len(region) - axes], region[len(region) - axes :]
    for index in product(*(range(axis.stop - axis.start) for axis in lead)):
        starts = [axis.start + i for axis, i in zip(lead, index, strict=True)]
        yield index, (*(slice(start, start + 1) for start in starts), *inner)


def _blurred(have: Intermediates, blur: Blur) -> Intermediates:
    if isinstance(blur, PsfField):
        whole = PsfEstimate(blur.psfs[0, 0], PsfStatus.GIVEN)
        return replace(have, psf=whole, field=blur)
    return replace(have, psf=PsfEstimate(blur, PsfStatus.GIVEN))


def _put(
    made: dict[str, Image], lead: tuple[int, ...], index: tuple[int, ...], have: Intermediates
) -> None:
    """Keep what the stages have made of a piece, in its place in that of the whole region."""
    pieces = {name: getattr(have, name) for name in ("linear", "sharp_linear", "result")}
    pieces |= {name: getattr(have.trust, name, None) for name in TRUST}
    for name, piece in pieces.items():
        if piece is None:
            continue
        if not lead:
            made[name] = piece
            continue
        if name not in made:
            made[name] = np.empty((*lead, *piece.shape), dtype=piece.dtype)
        made[name][index] = piece
