"""Point spread functions from and to pictures and arrays."""

from pathlib import Path

import numpy as np

from .._typing import FloatArray, Image
from ..errors import DAMAGED, CrfDeblurError
from ..photo import from_unit
from ..psf import as_psf, centered
from .files import check_input, check_output, replacing
from .images import TIFF, read_photo, write_photo
from .tiff import read_slices

SUFFIXES = (".png", *TIFF, ".npy")
VOLUME = 3  # axes


def read_psf(path: Path) -> FloatArray:
    """Read a PSF: scaled to sum 1, padded to odd sides, its center of mass in the middle.

    Parameters
    ----------
    path : Path
        Grayscale PNG or TIFF (color with equal channels passes), or NPY; any size. A TIFF with
        several gray pages, or an array of three axes, is a PSF of three dimensions.

    Returns
    -------
    ndarray, shape (H, W) or (D, H, W)
        float64, non-negative, all sides odd.

    Raises
    ------
    CrfDeblurError
        Missing, unreadable, in color, negative, not finite or all zero.
    """
    check_input(path)
    values = _read_array(path) if path.suffix.lower() == ".npy" else _read_picture(path)
    try:
        return centered(as_psf(values))
    except CrfDeblurError as error:
        raise CrfDeblurError(f"{path}: {error}") from error


def write_psf(path: Path, psf: FloatArray) -> None:
    """Write a PSF: NPY and TIFF keep its values, PNG is scaled to 16 bits for the eye.

    One of three dimensions becomes the pages of a TIFF, or an NPY.
    """
    check_output(path, SUFFIXES)
    if path.suffix.lower() == ".npy":
        with replacing(path) as temporary:
            np.save(temporary, psf)
    elif psf.ndim == VOLUME:
        _write_pages(path, psf)
    elif path.suffix.lower() == ".png":
        write_photo(path, from_unit(psf / psf.max(), np.uint16))
    else:
        write_photo(path, psf.astype(np.float32))


def _write_pages(path: Path, psf: FloatArray) -> None:
    import tifffile

    if path.suffix.lower() not in TIFF:
        raise CrfDeblurError(
            f"{path}: cannot hold a PSF of three dimensions; "
            "choose a name that ends in .tif or .npy"
        )
    with replacing(path) as temporary:
        tifffile.imwrite(temporary, psf.astype(np.float32), photometric="minisblack")


def _read_array(path: Path) -> FloatArray:
    try:
        values = np.load(path, allow_pickle=False)
    except DAMAGED as error:
        raise CrfDeblurError(f"{path}: not a whole NPY file ({error}); save it again") from error
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "fiub":
        raise CrfDeblurError(f"{path}: holds no real numbers; give one array of them")
    return values.astype(np.float64)


def _read_picture(path: Path) -> FloatArray:
    pixels = read_photo(path)
    if path.suffix.lower() in TIFF and (slices := _read_slices(path)) is not None:
        pixels = slices
    elif pixels.ndim == 3 and np.ptp(pixels[..., :3], axis=2).max() == 0:
        pixels = pixels[..., 0]
    return pixels.astype(np.float64)


def _read_slices(path: Path) -> Image | None:
    try:
        return read_slices(path)
    except DAMAGED as error:
        raise CrfDeblurError(
            f"{path}: the stack is truncated or damaged ({error}); get a whole copy"
        ) from error
