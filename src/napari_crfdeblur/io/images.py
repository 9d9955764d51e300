"""Photos from and to files: PNG, JPEG and TIFF, with 8 and 16 bits or floats."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TypeAlias

import numpy as np

from .. import arguments
from .._typing import Image
from .._version import __version__
from ..errors import DAMAGED, CrfDeblurError
from ..photo import ALPHA, check_image, color
from .files import check_output, replacing
from .inputs import damaged, open_input, size_of
from .limits import LIMITS, Claim, Limits
from .quiet import quiet
from .tiff import read_tiff

if TYPE_CHECKING:
    from PIL.ImageFile import ImageFile as PillowFile

TIFF = (".tif", ".tiff")
JPEG = (".jpg", ".jpeg")
WRITABLE = (".png", *TIFF, *JPEG)
JPEG_QUALITY = 95
PNG_EFFORT = 4  # of 9: files as small as with 6, the default, in a third of the time
LONGEST_EXIF = 65533  # bytes; a segment of a JPEG counts its own length in 16 bits

Check: TypeAlias = Callable[[Path, Claim], None]


def read_photo(path: Path | str, *, limits: Limits = LIMITS) -> Image:
    """Read a photo, upright.

    Parameters
    ----------
    path : Path
        PNG, JPEG or TIFF (its first page), turned as its orientation says.
    limits : Limits, optional
        The largest photo that is read.

    Returns
    -------
    ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        uint8, uint16 or float, as stored.

    Raises
    ------
    CrfDeblurError
        Missing, no image, too large, truncated, or of a kind that is not supported.
    """
    return read_picture(
        arguments.path(path), arguments.instance(limits, Limits, "Limits").check_photo
    )


def read_picture(path: Path, check: Check) -> Image:
    """Read a photo or a PSF as :func:`read_photo` does.

    Parameters
    ----------
    path : Path
        PNG, JPEG or TIFF.
    check : callable
        Refuses, with a CrfDeblurError, what the file claims to hold, before that is read.
    """
    with quiet(), open_input(path) as file:
        try:
            reader = _reader(file.read(26))
            if reader is None:
                raise CrfDeblurError(
                    f"{path}: not a PNG, JPEG or TIFF image; convert it to one of these"
                )
            file.seek(0)
            pixels = reader(path, file, check)
        except DAMAGED as error:
            what = "the image is truncated or damaged"
            raise damaged(path, what, error, "get a whole copy") from error
    return _supported(path, pixels)


def write_photo(path: Path | str, photo: Image, like: Path | str | None = None) -> None:
    """Write a photo, whole or not at all.

    Parameters
    ----------
    path : Path
        Its suffix says the kind: PNG (8 or 16 bit), JPEG (8 bit) or TIFF (any).
    photo : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        uint8, uint16 or float32. Floats are kept in TIFF, and become 16 bits in PNG, 8 in
        JPEG; JPEG drops an alpha channel.
    like : Path, optional
        Photo whose color profile and camera data go into a JPEG or an 8-bit PNG.
    """
    path = arguments.path(path)
    like = None if like is None else arguments.path(like)
    check_image(photo)
    if photo.size == 0:
        raise arguments.refusal("a photo with pixels", photo)
    check_output(path, WRITABLE)
    with replacing(path) as temporary:
        if path.suffix.lower() in TIFF:
            _write_tiff(temporary, photo)
        elif path.suffix.lower() in JPEG:
            _write_pillow(temporary, color(_as_integer(photo, np.uint8)), like)
        elif photo.dtype == np.uint8:
            _write_pillow(temporary, photo, like)
        else:
            _write_png16(temporary, _as_integer(photo, np.uint16))


def _reader(start: bytes) -> Callable[[Path, BinaryIO, Check], Image] | None:
    if start.startswith(b"\x89PNG\r\n\x1a\n"):
        bits = start[24] if len(start) > 24 else 0
        return _read_png16 if bits == 16 else _read_pillow
    if start.startswith(b"\xff\xd8\xff"):
        return _read_pillow
    if start[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return read_tiff
    return None


def _read_pillow(path: Path, file: BinaryIO, check: Check) -> Image:
    from PIL import ImageOps

    with opened_by_pillow(file) as opened:
        mode = _PLAIN_MODES.get(opened.mode, opened.mode)
        columns, rows = opened.size
        channels = PILLOW_CHANNELS.get(mode, 1)
        check(path, Claim((rows, columns), rows * columns * channels, size_of(file), channels))
        upright = ImageOps.exif_transpose(opened)
        upright.load()
    return np.asarray(upright.convert(_PLAIN_MODES.get(upright.mode, upright.mode)))


def opened_by_pillow(file: BinaryIO) -> "PillowFile":
    """A PNG or JPEG whose header is read, not its pixels.

    Without ``PIL.Image.open``, whose own limits are the same for all that use it.
    """
    from PIL.JpegImagePlugin import JpegImageFile
    from PIL.PngImagePlugin import PngImageFile

    start = file.read(4)
    file.seek(0)
    return PngImageFile(file) if start == b"\x89PNG" else JpegImageFile(file)


# Kinds of pixel that Pillow knows and we do not, and what shows the same picture.
_PLAIN_MODES = {"1": "L", "P": "RGBA", "LA": "RGBA", "PA": "RGBA", "CMYK": "RGB", "YCbCr": "RGB"}
PILLOW_CHANNELS = {"RGB": 3, "RGBA": 4}


def _read_png16(path: Path, file: BinaryIO, check: Check) -> Image:
    from imagecodecs import png_decode

    content = file.read()
    columns, rows, _, color_type = struct.unpack_from(">IIBB", content, 16)
    channels = PNG_CHANNELS.get(color_type, ALPHA)
    taken = 2 * channels * rows * columns
    check(path, Claim((rows, columns), taken, len(content), channels))
    return np.asarray(png_decode(content))


PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}  # by the color type


def _supported(path: Path, pixels: Image) -> Image:
    """The pixels as a photo, or a sentence that says why they are none."""
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        pixels = pixels[..., 0]
    if pixels.ndim == 3 and pixels.shape[2] == 2:  # gray with alpha
        pixels = np.concatenate([np.repeat(pixels[..., :1], 3, axis=2), pixels[..., 1:]], axis=2)
    if (
        pixels.size == 0
        or pixels.ndim not in (2, 3)
        or pixels.shape[2:] not in ((), (3,), (ALPHA,))
    ):
        raise CrfDeblurError(
            f"{path}: an image of shape {pixels.shape} is not supported; "
            "use a grayscale or RGB photo, one slice at a time"
        )
    if pixels.dtype == np.bool_:
        return pixels.astype(np.uint8) * 255
    if pixels.dtype not in (np.uint8, np.uint16, np.float16, np.float32, np.float64):
        raise CrfDeblurError(
            f"{path}: pixels of kind {pixels.dtype} are not supported; "
            "convert the image to 8 or 16 bits or to floats from 0 to 1"
        )
    return pixels


def _as_integer(photo: Image, dtype: type[np.uint8] | type[np.uint16]) -> Image:
    """The photo in another integer kind, scaled from full scale to full scale."""
    from ..photo import from_unit, to_unit

    return photo if photo.dtype == dtype else from_unit(to_unit(photo), dtype)


def _write_tiff(path: Path, photo: Image) -> None:
    import tifffile

    kind = "minisblack" if photo.ndim == 2 else "rgb"
    tifffile.imwrite(path, np.ascontiguousarray(photo), photometric=kind, compression="zlib")


def _write_png16(path: Path, photo: Image) -> None:
    from imagecodecs import png_encode

    path.write_bytes(png_encode(np.ascontiguousarray(photo)))


def _write_pillow(path: Path, photo: Image, like: Path | None) -> None:
    from PIL import Image as Pillow

    picture = Pillow.fromarray(np.ascontiguousarray(photo))
    if path.suffix.lower() in JPEG:
        picture.save(path, quality=JPEG_QUALITY, subsampling=0, **_camera_data(like))
    else:
        picture.save(path, compress_level=PNG_EFFORT, **_camera_data(like))


def _camera_data(like: Path | None) -> dict[str, Any]:
    """Color profile and EXIF data of a file, marked upright and processed; none for a TIFF.

    What is damaged, or too long for a JPEG, is left out: it is not what makes the photo.
    """
    from PIL.ExifTags import Base

    if like is None or like.suffix.lower() not in (".png", *JPEG):
        return {}
    try:
        with quiet(), open_input(like) as file, opened_by_pillow(file) as source:
            exif, profile = source.getexif(), source.info.get("icc_profile")
            exif.pop(Base.Orientation, None)
            if len(exif):  # what is written is not what the camera wrote, whatever else they say
                exif[Base.ProcessingSoftware] = f"napari-crfdeblur {__version__}"
            data = exif.tobytes() if len(exif) else b""
    except DAMAGED:
        return {}
    kept = {"exif": data} if 0 < len(data) <= LONGEST_EXIF else {}
    return kept | ({"icc_profile": profile} if profile else {})
