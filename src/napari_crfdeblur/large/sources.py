"""Photos larger than memory: opened without reading them, then read region by region."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._typing import Image
from ..deconvolution.tiles import Region
from ..errors import DAMAGED, CrfDeblurError
from ..io import read_photo
from ..io.files import check_input
from ..io.images import TIFF
from ..photo import ALPHA
from .stamp import Stamp

NPY, ZARR = ".npy", ".zarr"
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

    def read(self, region: Region) -> Image:
        """Pixels of a region; looks before and after whether the file has changed."""
        self._look()
        try:
            pixels = self._pixels(region)
        except DAMAGED as error:
            self.check()
            raise CrfDeblurError(
                f"{self.stamp.path}: the image is truncated or damaged ({error}); get a whole copy"
            ) from error
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
        return np.array(np.load(self.stamp.path, mmap_mode="r")[region])


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
        return np.asarray(zarr_array(self.stamp.path)[region])


def open_source(path: Path) -> Source:
    """Open a photo or a stack without reading it.

    Parameters
    ----------
    path : Path
        TIFF, NPY or a folder of zarr; PNG and JPEG are read whole, for lack of regions in them.

    Raises
    ------
    CrfDeblurError
        Missing, damaged, or not a photo.
    """
    if path.is_dir():
        return _of_zarr(path)
    check_input(path)
    stamp = Stamp.of(path)
    if path.suffix.lower() not in (*TIFF, NPY):
        photo = read_photo(path)
        stamp.check()
        return InMemory.of(photo)
    try:
        if path.suffix.lower() == NPY:
            stored = np.load(path, mmap_mode="r")
            return _checked(NpyFile(stamp, *_kind(stored)))
        from .tiff import layout

        found = layout(stamp)
        return _checked(TiffFile(stamp, found.shape, found.dtype, found.color))
    except DAMAGED as error:
        raise CrfDeblurError(f"{path}: the image is damaged ({error}); get a whole copy") from error


def zarr_array(path: Path) -> Any:
    """The array in a folder of zarr; of an image in several resolutions the finest."""
    zarr = zarr_module(path)
    try:
        found = zarr.open(path, mode="r")
        if isinstance(found, zarr.Group):
            scales = found.attrs.get("ome", found.attrs).get("multiscales")
            found = found[scales[0]["datasets"][0]["path"] if scales else "0"]
    except (*DAMAGED, zarr.errors.BaseZarrError) as error:
        raise CrfDeblurError(
            f"{path}: this folder holds no array of zarr ({error}); give a file or such a folder"
        ) from error
    return found


def zarr_module(path: Path) -> Any:
    """The optional package, needed for `path`."""
    try:
        import zarr
    except ImportError as error:
        raise CrfDeblurError(
            f'{path}: zarr is missing; install it with pip install "napari-crfdeblur[large]"'
        ) from error
    return zarr


def _of_zarr(path: Path) -> Source:
    stamp = Stamp.of(path)
    return _checked(ZarrFolder(stamp, *_kind(zarr_array(path))))


def _kind(stored: Any) -> tuple[tuple[int, ...], np.dtype[Any], bool]:
    shape = tuple(stored.shape)
    color = len(shape) > 2 and shape[-1] in (3, ALPHA)
    return shape, np.dtype(stored.dtype).newbyteorder("="), color


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
    return source
