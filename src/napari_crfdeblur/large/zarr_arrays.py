"""Arrays of zarr that nobody vouches for: no part is decoded to more than its place has room for.

Only folders are read, and in them only regular files. Codecs that could run code, or whose
results could be of any size, are refused; those that decompress are replaced by ones that stop
where a part is full.
"""

import asyncio
import stat
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from math import ceil, prod
from pathlib import Path
from typing import Any

import imagecodecs
import numcodecs.abc  # type: ignore[import-untyped]
import numpy as np
import zarr
from zarr.abc.codec import BytesBytesCodec
from zarr.abc.store import RangeByteRequest
from zarr.codecs import ShardingCodec
from zarr.storage import LocalStore, StorePath

from ..errors import DAMAGED, CrfDeblurError
from ..io.inputs import damaged
from ..io.limits import Limits

FAILURES = (*DAMAGED, AssertionError)  # zarr asserts what it expects of metadata
METADATA = ("zarr.json", ".zarray", ".zattrs", ".zgroup", ".zmetadata")
# Results of these are as large as what they are given, or up to eight times.
PLAIN = {
    *("bytes", "endian", "transpose", "crc32c"),
    *("bitround", "delta", "fixedscaleoffset", "quantize", "shuffle"),
}
DECODERS: dict[str, Callable[..., bytes | bytearray]] = {
    "blosc": imagecodecs.blosc_decode,
    "bz2": imagecodecs.bz2_decode,
    "gzip": imagecodecs.gzip_decode,
    "lz4": lambda content, out: imagecodecs.lz4_decode(content, header=True, out=out),
    "zlib": imagecodecs.zlib_decode,
    "zstd": imagecodecs.zstd_decode,
}
SLACK = 1 << 16  # bytes that codecs add to what they cannot compress, with a share of 1/64
INDEX = 16  # bytes of a shard's index for each part of it


def open_array(path: Path, limits: Limits) -> Any:
    """The array in a folder; of an image in several resolutions the finest.

    Raises
    ------
    CrfDeblurError
        There is none, its description makes no sense, or it is stored in a way that is not read.
    """
    try:
        found: Any = zarr.open(_Folder(path, limits.json, limits.json), mode="r")
        if isinstance(found, zarr.Group):
            found = _finest(found)
        if not isinstance(found, zarr.Array):
            raise ValueError("a group in a group")
        return _bounded(path, found, limits)
    except (*FAILURES, zarr.errors.BaseZarrError) as error:
        what = "this folder holds no array of zarr"
        raise damaged(path, what, error, "give a file or such a folder") from error


def _finest(group: Any) -> Any:
    scales = group.attrs.get("ome", group.attrs).get("multiscales")
    return group[scales[0]["datasets"][0]["path"] if scales else "0"]


def _bounded(path: Path, array: Any, limits: Limits) -> Any:
    """The same array, of which no part takes more memory than it has pixels for."""
    chunks, shards = array.chunks, array.shards
    if min(*chunks, *(shards or (1,)), *array.shape) < 1:
        raise ValueError(f"parts of shape {chunks}")
    taken = prod(chunks) * np.dtype(array.dtype).itemsize
    inside = prod(map(ceil, (a / b for a, b in zip(shards, chunks, strict=True)))) if shards else 1
    limits.check_chunk(path, max(taken, INDEX * inside))
    most = _room(taken)
    metadata = array.metadata
    if metadata.zarr_format == 2:
        compressor = metadata.compressor
        _check(path, [*(each.codec_id for each in metadata.filters or ())])
        if compressor is not None:
            compressor = _Compressor(_decoder(path, compressor.codec_id), most)
        metadata = replace(metadata, compressor=compressor)
    else:
        metadata = replace(metadata, codecs=_codecs(path, metadata.codecs, most))
    store = _Folder(path, limits.json, inside * (most + INDEX) + SLACK)
    place = StorePath(store, array.store_path.path)
    return zarr.Array(zarr.AsyncArray(metadata=metadata, store_path=place))


def _room(taken: int) -> int:
    return taken + taken // 64 + SLACK


def _codecs(path: Path, codecs: Iterable[Any], most: int, within: bool = False) -> list[Any]:
    """Codecs of zarr's third format, with ours for those that decompress."""
    codecs = list(codecs)
    found: list[Any] = []
    for codec in codecs:
        name = codec.to_dict()["name"].removeprefix("numcodecs.")
        if isinstance(codec, ShardingCodec) and len(codecs) == 1 and not within:
            inner = _codecs(path, codec.codecs, most, within=True)
            _check(path, [str(each.to_dict()["name"]) for each in codec.index_codecs])
            found.append(replace(codec, codecs=tuple(inner)))
        elif name in PLAIN:
            found.append(codec)
        else:
            found.append(_Decompression(_decoder(path, name), most))
    return found


def _check(path: Path, names: Iterable[str]) -> None:
    for name in names:
        if name not in PLAIN:
            raise _refused(path, name)


def _decoder(path: Path, name: str) -> str:
    if name not in DECODERS:
        raise _refused(path, name)
    return name


def _refused(path: Path, name: str) -> CrfDeblurError:
    return CrfDeblurError(
        f"{path}: arrays of zarr that are stored by {name} are not read; store it again with "
        f"one of {', '.join(DECODERS)}"
    )


def _decode(name: str, content: Any, most: int) -> bytes:
    """What was compressed, if it is no longer than `most` bytes."""
    decoded = DECODERS[name](bytes(content), out=most + 1)
    if len(decoded) > most:
        raise ValueError(f"a part is larger than {most} bytes, the most that its pixels need")
    return bytes(decoded)


@dataclass(frozen=True)
class _Decompression(BytesBytesCodec):
    """A codec of zarr's third format that stops where a part is full."""

    name: str
    most: int

    is_fixed_size = False

    def to_dict(self) -> dict[str, Any]:
        return {"name": self.name, "configuration": {"most": self.most}}

    async def _decode_single(self, chunk_data: Any, chunk_spec: Any) -> Any:
        content = await asyncio.to_thread(_decode, self.name, chunk_data.to_bytes(), self.most)
        return chunk_spec.prototype.buffer.from_bytes(content)

    def compute_encoded_size(self, input_byte_length: int, chunk_spec: Any) -> int:
        raise NotImplementedError


class _Compressor(numcodecs.abc.Codec):  # type: ignore[misc]
    """The same for the second format."""

    codec_id = "bounded"

    def __init__(self, name: str, most: int) -> None:
        self.name, self.most = name, most

    def encode(self, buf: Any) -> Any:
        raise NotImplementedError

    def decode(self, buf: Any, out: Any | None = None) -> Any:  # noqa: ARG002 - numcodecs' own
        return _decode(self.name, buf, self.most)

    def get_config(self) -> dict[str, Any]:
        return {"id": self.codec_id, "name": self.name, "most": self.most}


class _Folder(LocalStore):
    """Files in a folder, of which each is regular and no longer than it may be."""

    def __init__(self, root: Path, described: int, stored: int, read_only: bool = True) -> None:
        super().__init__(root, read_only=read_only)
        self._described, self._stored = described, stored

    def with_read_only(self, read_only: bool = False) -> "_Folder":
        return type(self)(self.root, self._described, self._stored, read_only)

    async def get(self, key: str, prototype: Any = None, byte_range: Any = None) -> Any:
        self._look(key, byte_range)
        return await super().get(key, prototype, byte_range)

    def _look(self, key: str, byte_range: Any) -> None:
        try:
            found = (self.root / key).stat()
        except (FileNotFoundError, NotADirectoryError):
            return
        if stat.S_ISDIR(found.st_mode):
            return
        if not stat.S_ISREG(found.st_mode):
            raise ValueError(f"{key} is a pipe or a device")
        size = found.st_size
        if isinstance(byte_range, RangeByteRequest):
            size = byte_range.end - byte_range.start
        most = self._described if Path(key).name in METADATA else self._stored
        if size > most and (byte_range is None or isinstance(byte_range, RangeByteRequest)):
            raise ValueError(f"{key} has {size} bytes, more than what it holds can need")
