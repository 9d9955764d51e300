"""How much may be read: stated for every kind of file, checked before memory is taken."""

from dataclasses import dataclass, replace
from math import prod
from pathlib import Path

from .. import arguments
from ..errors import CrfDeblurError
from ..photo import ALPHA
from ..texts import brief

MEGA = 1_000_000


@dataclass(frozen=True, slots=True)
class Claim:
    """What a file says that it holds, before that is read.

    Parameters
    ----------
    shape : tuple of int
        Of the picture, without its channels, or of an array.
    taken : int
        Bytes of memory that it needs.
    stored : int
        Bytes of the file.
    channels : int
        Of a picture.
    """

    shape: tuple[int, ...]
    taken: int
    stored: int
    channels: int = 1


@dataclass(frozen=True, slots=True)
class Limits:
    """The most that is read of a file. What is larger is refused in a sentence.

    Parameters
    ----------
    photo : int
        Pixels of a photo that is read whole. Cameras make up to 400 million, by shifting their
        sensor; a copy of the default in linear light is 6 GB.
    large : int
        Pixels of a photo or a stack that is read in parts: a million by a million.
    chunk : int
        Bytes of a part that is decoded whole whenever a pixel of it is needed. Ten are at work
        at a time, and common ones have a few million.
    psf_side : int
        Pixels of a side of a PSF: a blur half as long as a photo cannot be undone.
    psf : int
        Values of a PSF, or of one of three dimensions, such as 512 x 512 x 128.
    json : int
        Bytes of a JSON file; in memory it takes up to twenty times as many. A hundred PSFs of
        101 x 101 are 22 million.
    journal : int
        Bytes of the journal of a batch: about 500 for a photo.
    nesting : int
        Lists and objects within each other in JSON. Responses that were tuned many times have
        some dozens.
    ratio : int
        Bytes of a picture for each byte of its file. Deflate makes 1032 of one at the most, LZW
        2560, and each may be 32 pixels of a palette; more cannot be in the file. It refuses no
        picture that compresses well.
    """

    photo: int = 500 * MEGA
    large: int = MEGA**2
    chunk: int = 1 << 28
    psf_side: int = 2048
    psf: int = 1 << 25
    json: int = 1 << 25
    journal: int = 1 << 28
    nesting: int = 100
    ratio: int = 1 << 16

    def __post_init__(self) -> None:
        for name in self.__slots__:
            arguments.number(getattr(self, name), name, least=1)

    def with_photos_of(self, megapixels: float) -> "Limits":
        """These limits for photos of up to so many megapixels, read whole or in parts."""
        arguments.number(megapixels, "a number of megapixels", above=0)
        photo = max(1, round(megapixels * MEGA))
        return replace(self, photo=photo, large=max(self.large, photo))

    def check_photo(self, path: Path, claim: Claim) -> None:
        """Refuse a photo that is too large, or larger than its file can hold."""
        rows, columns = claim.shape
        if rows * columns > self.photo:
            raise CrfDeblurError(
                f"{path}: the image is too large: {columns} x {rows} pixels, where at most "
                f"{self.photo / MEGA:g} megapixels are read; crop it or make it smaller, or, if "
                "there is memory enough, allow larger photos (--largest-photo MEGAPIXELS)"
            )
        if claim.channels > ALPHA:
            raise CrfDeblurError(
                f"{path}: an image of shape {(*claim.shape, claim.channels)} is not supported; "
                "use a grayscale or RGB photo, one slice at a time"
            )
        self._check_ratio(path, claim)

    def check_large(self, path: Path, shape: tuple[int, ...], color: bool) -> None:
        """Refuse a photo or stack that is too large even to be read in parts."""
        if prod(shape[:-1] if color else shape) > self.large:
            raise CrfDeblurError(
                f"{path}: an image of shape {brief(shape)} is too large, or its description is "
                f"wrong: at most {self.large / MEGA:.0f} megapixels are read in parts; give a part "
                "of it"
            )

    def check_chunk(self, path: Path, taken: int) -> None:
        """Refuse parts that are too large to be decoded."""
        if taken > self.chunk:
            raise CrfDeblurError(
                f"{path}: is stored in parts of {taken / MEGA:.0f} MB, where at most "
                f"{self.chunk / MEGA:.0f} MB are read at a time; store it in smaller parts"
            )

    def check_psf(self, path: Path, claim: Claim) -> None:
        """Refuse a PSF that is too large, or larger than its file can hold."""
        if max(claim.shape, default=0) > self.psf_side or prod(claim.shape) > self.psf:
            raise CrfDeblurError(
                f"{path}: the PSF is too large: {_times(claim.shape)}, where at most "
                f"{self.psf_side} pixels on a side and {self.psf / MEGA:.0f} million values "
                "are read; cut away what is dark around it"
            )
        self._check_ratio(path, claim)

    def _check_ratio(self, path: Path, claim: Claim) -> None:
        if claim.taken > self.ratio * claim.stored:
            raise CrfDeblurError(
                f"{path}: the image is truncated or damaged (a file of {claim.stored} bytes "
                f"cannot hold {_times(claim.shape)} values); get a whole copy"
            )


def _times(shape: tuple[int, ...]) -> str:
    return brief(" x ".join(map(str, shape)))


LIMITS = Limits()
