"""Point spread functions from and to pictures and arrays."""

from pathlib import Path

import numpy as np

from .. import arguments
from .._typing import FloatArray, Image
from ..errors import DAMAGED, CrfDeblurError, about
from ..photo import from_unit
from ..psf import as_psf, centered
from .files import check_output, replacing
from .images import TIFF, read_picture, write_photo
from .inputs import damaged, open_input, size_of
from .limits import LIMITS, Claim, Limits
from .npy import npy_layout, read_npy
from .quiet import quiet
from .tiff import read_slices

SUFFIXES = (".png", *TIFF, ".npy")
VOLUME = 3  # axes


def read_psf(path: Path | str, *, limits: Limits = LIMITS) -> FloatArray:
    """Read a PSF: scaled to sum 1, padded to odd sides, its center of mass in the middle.

    Parameters
    ----------
    path : Path
        Grayscale PNG or TIFF (color with equal channels passes), or NPY. A TIFF with several
        gray pages, or an array of three axes, is a PSF of three dimensions.
    limits : Limits, optional
        The largest PSF that is read.

    Returns
    -------
    ndarray, shape (H, W) or (D, H, W)
        float64, non-negative, all sides odd.

    Raises
    ------
    CrfDeblurError
        Missing, unreadable, too large, in color, negative, not finite or all zero.
    """
    path = arguments.path(path)
    arguments.instance(limits, Limits, "Limits")
    npy = path.suffix.lower() == ".npy"
    values = _read_array(path, limits) if npy else _read_pixels(path, limits)
    try:
        return centered(values)
    except CrfDeblurError as error:
        raise about(path, error) from error


def write_psf(path: Path | str, psf: FloatArray) -> None:
    """Write a PSF: NPY and TIFF keep its values, PNG is scaled to 16 bits for the eye.

    One of three dimensions becomes the pages of a TIFF, or an NPY.

    Parameters
    ----------
    path : Path
        File that ends in ``.png``, ``.tif``, ``.tiff`` or ``.npy``.
    psf : ndarray, shape (H, W) or (D, H, W)
        What :func:`~napari_crfdeblur.psf.as_psf` takes, and is made of it first.
    """
    path, psf = arguments.path(path), as_psf(psf)
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


def _read_array(path: Path, limits: Limits) -> FloatArray:
    with quiet(), open_input(path) as file:
        try:
            layout = npy_layout(file)
            limits.check_psf(path, Claim(layout.shape, layout.taken, size_of(file)))
            return read_npy(file, layout).astype(np.float64, order="C")
        except DAMAGED as error:
            advice = "give one array of real numbers, saved whole"
            raise damaged(path, "not a whole NPY file", error, advice) from error


def _read_pixels(path: Path, limits: Limits) -> FloatArray:
    pixels = read_picture(path, limits.check_psf)
    if path.suffix.lower() in TIFF and (slices := _read_slices(path, limits)) is not None:
        pixels = slices
    elif pixels.ndim == 3 and np.ptp(pixels[..., :3], axis=2).max() == 0:
        pixels = pixels[..., 0]
    return pixels.astype(np.float64)


def _read_slices(path: Path, limits: Limits) -> Image | None:
    with quiet(), open_input(path) as file:
        try:
            return read_slices(path, file, limits.check_psf)
        except DAMAGED as error:
            what = "the stack is truncated or damaged"
            raise damaged(path, what, error, "get a whole copy") from error
