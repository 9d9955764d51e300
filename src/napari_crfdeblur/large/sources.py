"""Photos larger than memory: opened without reading them, then read region by region."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._typing import Image
from ..crew.stamp import Stamp
from ..deconvolution.tiles import Region
from ..errors import DAMAGED, CrfDeblurError
from ..io import read_photo
from ..io.files import check_input
from ..io.images import TIFF
from ..io.inputs import damaged, is_folder, open_input
from ..io.limits import LIMITS, Limits
from ..io.npy import npy_layout, read_npy_region
from ..io.quiet import quiet
from ..photo import ALPHA

NPY, ZARR = ".npy", ".zarr"
FAILURES = (*DAMAGED, AssertionError)  # zarr asserts what it expects of what is stored
KINDS = (np.uint8, np.uint16, np.float16, np.float32, np.float64)


class Source(ABC):
    """A photo or a stack of photos of which any region can be read at any time.

    It can be sent to other processes, as long as they find the file under the same name.
    """

    __slots__ = ()

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    color: bool
    """Whether the last axis has 3 or 4 channels."""

    @abstractmethod
    def read(self, region: Region) -> Image:
        """Pixels of a region that has a slice, of step 1, for every axis.

        Raises
        ------
        CrfDeblurError
            Damaged, or changed since it was opened.
        """

    @abstractmethod
    def check(self) -> None:
        """Refuse to go on with a photo that has changed since it was opened."""


@dataclass(frozen=True, slots=True, eq=False)
class InMemory(Source):
    """Pixels that are in memory already."""

    pixels: Image
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    color: bool

    @classmethod
    def of(cls, pixels: Image) -> "InMemory":
        """A photo, or a stack of them."""
        return cls(pixels, *_kind(pixels))

    def read(self, region: Region) -> Image:
        """Pixels of a region."""
        return self.pixels[region]

    def check(self) -> None:
        """Nothing changes them."""


@dataclass(frozen=True, slots=True)
class InFile(Source):
    """A file or folder that is read where it lies, by a method for its kind."""

    stamp: Stamp
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    color: bool
    limits: Limits = LIMITS

    def read(self, region: Region) -> Image:
        """Pixels of a region; looks before and after whether the file has changed."""
        self._look()
        try:
            with quiet():
                pixels = self._pixels(region)
        except FAILURES as error:
            self.check()
            what = "the image is truncated or damaged"
            raise damaged(self.stamp.path, what, error, "get a whole copy") from error
        self._look()
        return np.ascontiguousarray(pixels, dtype=self.dtype)

    def check(self) -> None:
        """Refuse to go on with a file that has changed since it was opened."""
        self.stamp.check()

    def _look(self) -> None:
        self.stamp.check()

    def _pixels(self, region: Region) -> Image:
        raise NotImplementedError


class NpyFile(InFile):
    """An array that numpy stored."""

    __slots__ = ()

    def _pixels(self, region: Region) -> Image:
        with open_input(self.stamp.path) as file:
            layout = npy_layout(file)
            if layout.shape != self.shape:
                raise ValueError(f"its shape is {layout.shape} now")
            return read_npy_region(file, layout, region)


class TiffFile(InFile):
    """A TIFF: tiles, strips or one block, compressed or not; pages are slices of a stack."""

    __slots__ = ()

    def _pixels(self, region: Region) -> Image:
        from .tiff import read_region

        return read_region(self.stamp, region)


class ZarrFolder(InFile):
    """An array of zarr, or the finest one of an OME-Zarr image."""

    __slots__ = ()

    def _look(self) -> None:
        """Too many files to look at for every region: the end of the work is soon enough."""

    def _pixels(self, region: Region) -> Image:
        array = zarr_array(self.stamp.path, self.limits)
        if array.shape != self.shape:
            raise ValueError(f"its shape is {array.shape} now")
        return np.asarray(array[region])


def open_source(path: Path, *, limits: Limits = LIMITS) -> Source:
    """Open a photo or a stack without reading it.

    Parameters
    ----------
    path : Path
        TIFF, NPY or a folder of zarr; PNG and JPEG are read whole, for lack of regions in them.
    limits : Limits, optional
        The largest photo that is read.

    Raises
    ------
    CrfDeblurError
        Missing, damaged, too large, or not a photo.
    """
    if is_folder(path):
        return _of_zarr(path, limits)
    check_input(path)
    stamp = Stamp.of(path)
    if path.suffix.lower() not in (*TIFF, NPY):
        photo = read_photo(path, limits=limits)
        stamp.check()
        return InMemory.of(photo)
    kind = _of_npy if path.suffix.lower() == NPY else _of_tiff
    try:
        with quiet():
            return _checked(kind(stamp, limits))
    except DAMAGED as error:
        raise damaged(path, "the image is damaged", error, "get a whole copy") from error


def zarr_array(path: Path, limits: Limits = LIMITS) -> Any:
    """The array in a folder of zarr; of an image in several resolutions the finest."""
    zarr_module(path)
    from .zarr_arrays import open_array

    return open_array(path, limits)


def zarr_module(path: Path) -> Any:
    """The optional package, needed for `path`."""
    try:
        import zarr
    except ImportError as error:
        raise CrfDeblurError(
            f'{path}: zarr is missing; install it with pip install "napari-crfdeblur[large]"'
        ) from error
    return zarr


def _of_zarr(path: Path, limits: Limits) -> Source:
    stamp = Stamp.of(path)
    with quiet():
        return _checked(ZarrFolder(stamp, *_kind(zarr_array(path, limits)), limits))


def _of_npy(stamp: Stamp, limits: Limits) -> InFile:
    with open_input(stamp.path) as file:
        layout = npy_layout(file)
    return NpyFile(stamp, *_kind_of(layout.shape, layout.stored), limits)


def _of_tiff(stamp: Stamp, limits: Limits) -> InFile:
    from .tiff import layout

    found = layout(stamp)
    return TiffFile(stamp, found.shape, found.dtype, found.color, limits)


def _kind(stored: Any) -> tuple[tuple[int, ...], np.dtype[Any], bool]:
    return _kind_of(tuple(stored.shape), np.dtype(stored.dtype))


def _kind_of(
    shape: tuple[int, ...], stored: np.dtype[Any]
) -> tuple[tuple[int, ...], np.dtype[Any], bool]:
    color = len(shape) > 2 and shape[-1] in (3, ALPHA)
    return shape, stored.newbyteorder("="), color


def _checked(source: InFile) -> InFile:
    if source.dtype not in KINDS:
        raise CrfDeblurError(
            f"{source.stamp.path}: pixels of kind {source.dtype} are not supported; "
            "convert the image to 8 or 16 bits or to floats from 0 to 1"
        )
    if len(source.shape) < 2 + source.color or 0 in source.shape:
        raise CrfDeblurError(
            f"{source.stamp.path}: an image of shape {source.shape} is not supported; "
            "give a photo or a stack of photos"
        )
    source.limits.check_large(source.stamp.path, source.shape, source.color)
    return source
