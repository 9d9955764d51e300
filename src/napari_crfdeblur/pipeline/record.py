"""What was done with a photo: enough to do it again, and to say whether the same comes out."""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from numbers import Integral
from types import NoneType
from typing import Any

import numpy as np

from .. import arguments
from .._typing import Image
from .._version import __version__
from ..errors import CrfDeblurError
from ..photo import little_endian
from ..progress import Job, Progress
from .options import DeblurOptions
from .path import Stage
from .stack import PhotoStack, Restored, planes_of

PACKAGE = "napari-crfdeblur"
BAND = 256  # rows whose checksum is taken at a time: some 100 MB of the widest photos
LIBRARIES = ("numpy", "scipy", "scikit-image")  # on which the numbers depend


@dataclass(frozen=True, slots=True)
class Pixels:
    """What tells one picture or stack from another.

    Parameters
    ----------
    name : str
        Of its file or layer, for the reader alone.
    digest : str
        SHA-256 of the values, slice by slice, little-endian.
    shape : tuple of int
        Colors included.
    kind : str
        Of number, such as ``uint8``.
    """

    name: str
    digest: str
    shape: tuple[int, ...]
    kind: str

    def __post_init__(self) -> None:
        for name in ("name", "digest", "kind"):
            arguments.instance(getattr(self, name), str, f"a {name} as text")
        for side in arguments.instances(self.shape, Integral, "a shape"):
            arguments.whole(side, "a side", least=0)
        object.__setattr__(self, "shape", tuple(self.shape))

    def same_as(self, other: "Pixels") -> bool:
        """Whether both have the same values, whatever they are called."""
        return (self.digest, self.shape, self.kind) == (other.digest, other.shape, other.kind)


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """What was done with a photo. It names no file, neither to be read nor to be written.

    Parameters
    ----------
    photo : Pixels
        What went in.
    options : DeblurOptions
        How: all that was chosen by the user, in full.
    until : Stage
        How far.
    plane : tuple of int
        Slice of a stack in which response and PSF were found: its index over all axes but
        rows and columns.
    region : tuple of (int, int), optional
        Start and stop of each axis of what was restored; all of it by default.
    white : float, optional
        Value that stands for intensity 1, if it is not the full scale.
    tiled : bool
        Whether the blur was undone in tiles, which differ a little from the whole.
    chosen : dict of str to object
        What was chosen automatically, by the name of the option, to be read.
    versions : dict of str to str
        Of this package and of those on which the numbers depend.
    result : Pixels, optional
        What came out.
    """

    photo: Pixels
    options: DeblurOptions
    until: Stage = Stage.REAPPLY
    plane: tuple[int, ...] = ()
    region: tuple[tuple[int, int], ...] | None = None
    white: float | None = None
    tiled: bool = False
    chosen: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=lambda: versions())
    result: Pixels | None = None

    def __post_init__(self) -> None:
        arguments.instance(self.photo, Pixels, "the Pixels of a photo")
        arguments.instance(self.options, DeblurOptions, "DeblurOptions")
        arguments.instance(self.until, Stage, "a Stage")
        for index in arguments.instances(self.plane, Integral, "the index of a slice"):
            arguments.whole(index, "the index of a slice", least=0)
        spans = () if self.region is None else self.region
        for span in arguments.instances(spans, Sequence, "start and stop of each axis"):
            if len(span) != 2:
                raise arguments.refusal("start and stop of an axis", span)
            arguments.whole(span[0], "the start of an axis", least=0)
            arguments.whole(span[1], "the stop of an axis", least=span[0])
        if self.white is not None:
            arguments.number(self.white, "a white level", above=0)
        arguments.instance(self.tiled, bool, "whether it was done in tiles")
        for named in (self.chosen, self.versions):
            arguments.instance(named, dict, "values by their names")
        arguments.instance(self.result, (Pixels, NoneType), "the Pixels of a result or None")

    def check_fits(self, stack: PhotoStack) -> None:
        """Refuse a photo on which this cannot be done again.

        Raises
        ------
        CrfDeblurError
            Other axes, or too few slices, rows or columns.
        """
        spans = self.region or ()
        stops = [*(index + 1 for index in self.plane)] + [0] * (2 if self.plane else 0)
        for wanted in (stops, [stop for _, stop in spans]):
            if wanted and len(wanted) != len(stack.shape):
                raise CrfDeblurError(
                    f"the record is of a photo with {len(wanted)} axes, but this one has "
                    f"{len(stack.shape)}; give one like it"
                )
            if any(need > side for need, side in zip(wanted, stack.shape, strict=False)):
                raise CrfDeblurError(
                    "the record is of a part that this photo does not have; give a larger one"
                )


def versions() -> dict[str, str]:
    """Of this package and of those on which the numbers depend."""
    return {PACKAGE: __version__} | {name: _version(name) for name in LIBRARIES}


@cache
def _version(name: str) -> str:
    """Of a library, which stays as it is while the program runs."""
    return version(name)


def identifying(stack: PhotoStack) -> Job[Pixels]:
    """Long job: what tells a photo or a stack from others; read slice by slice."""
    digest = hashlib.sha256()
    parts = list(planes_of(stack.whole))
    for done, plane in enumerate(parts):
        yield Progress("checksum", done, len(parts))
        for rows in _bands(plane[-2]):
            pixels = np.asarray(stack.data[(*plane[:-2], rows, plane[-1])])
            digest.update(little_endian(pixels))
    shape = tuple(int(side) for side in stack.data.shape)
    return Pixels(stack.name, digest.hexdigest(), shape, stack.dtype.name)


def result_of(stack: PhotoStack, restored: Restored) -> Pixels | None:
    """What tells the last thing that was made of a stack from others; None if nothing was."""
    made = (restored.photo, restored.sharp_linear, restored.linear)
    newest = next((each for each in made if each is not None), None)
    return None if newest is None else pixels_of(stack.name, newest)


def pixels_of(name: str, pixels: Image) -> Pixels:
    """What tells an array from others."""
    digest = hashlib.sha256(little_endian(pixels)).hexdigest()
    return Pixels(name, digest, tuple(pixels.shape), pixels.dtype.name)


def _bands(rows: slice) -> Iterable[slice]:
    """Rows that are read at a time, so that a large photo need not fit into memory."""
    return (slice(i, min(i + BAND, rows.stop)) for i in range(rows.start, rows.stop, BAND))
