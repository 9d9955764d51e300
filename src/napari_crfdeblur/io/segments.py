"""Compressed parts of a TIFF: none is decoded that claims to be larger than its place."""

from collections.abc import Iterator
from pathlib import Path
from struct import unpack_from
from typing import TYPE_CHECKING, BinaryIO

from ..errors import CrfDeblurError

if TYPE_CHECKING:
    from tifffile import TiffFrame, TiffPage

# Of their pixels no more is taken than the place has room for: none, CCITT, LZW, deflate,
# PackBits, LZMA, Zstandard.
BOUNDED = {1, 2, 3, 4, 5, 8, 32946, 32773, 34925, 34926, 50000}
# Pictures of their own, which say how large they are.
JPEG = {6, 7, 33007, 34892}
JPEG_2000 = {33003, 33004, 33005, 34712}
# An encoder may store a row of two colors as one of half the length, and fill up its blocks.
SLACK = 4
SMALL = 1 << 16  # pixels that do no harm


def check_compression(path: Path, page: "TiffPage") -> None:
    """Refuse pictures whose parts could be of any size.

    Raises
    ------
    CrfDeblurError
        They are compressed by a method that is not read.
    """
    if page.compression not in BOUNDED | JPEG | JPEG_2000:
        name = getattr(page.compression, "name", page.compression)
        raise CrfDeblurError(
            f"{path}: TIFF images compressed by {name} are not read; save it with deflate, LZW "
            "or JPEG, or uncompressed"
        )


def check_segments(file: BinaryIO, page: "TiffPage | TiffFrame", first: "TiffPage") -> None:
    """Raise ValueError if a part of a page, stored like the first, claims more than its place."""
    if first.compression not in JPEG | JPEG_2000:
        return
    _check_claims(first.jpegtables or b"", first)
    for start, count in zip(page.dataoffsets, page.databytecounts, strict=True):
        file.seek(start)
        _check_claims(file.read(count), first)


def check_segment(content: bytes, page: "TiffPage") -> None:
    """Raise ValueError if one part of a page claims to be larger than its place."""
    if page.compression in JPEG | JPEG_2000:
        _check_claims(page.jpegtables or b"", page)
        _check_claims(content, page)


def _check_claims(content: bytes, page: "TiffPage") -> None:
    rows = page.tilelength if page.is_tiled else min(page.rowsperstrip, page.imagelength)
    columns = page.tilewidth if page.is_tiled else page.imagewidth
    sizes = _sizes_of_jpeg if page.compression in JPEG else _sizes_of_jpeg_2000
    for height, width in sizes(content):
        if height * width > max(SLACK * rows * columns, SMALL):
            raise ValueError(f"a part of it claims to have {width} x {height} pixels")


def _sizes_of_jpeg(content: bytes) -> Iterator[tuple[int, int]]:
    """Height and width in each frame header before the pixels (ISO 10918-1, B.2.2)."""
    place = content.find(b"\xff")
    while 0 <= place < len(content) - 9:
        marker = content[place + 1]
        if marker == 0xDA:  # the pixels begin
            return
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            yield unpack_from(">HH", content, place + 5)
        if marker in (0x00, 0x01, 0xFF) or 0xD0 <= marker <= 0xD9:  # without content
            place += 1 if marker == 0xFF else 2
        else:
            place += 2 + unpack_from(">H", content, place + 2)[0]
        place = content.find(b"\xff", place)


def _sizes_of_jpeg_2000(content: bytes) -> Iterator[tuple[int, int]]:
    """Height and width of each codestream (ISO 15444-1, A.5.1), alone or in boxes."""
    place = content.find(b"\xff\x4f\xff\x51")
    while 0 <= place <= len(content) - 24:
        width, height, left, top = unpack_from(">IIII", content, place + 8)
        yield max(0, height - top), max(0, width - left)
        place = content.find(b"\xff\x4f\xff\x51", place + 4)
