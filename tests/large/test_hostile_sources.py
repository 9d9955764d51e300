"""Large photos that nobody vouches for: no part is decoded beyond its place, no code is run."""

import bz2
import gzip
import json
import os
import pickle
import subprocess
import sys
import zlib

import numcodecs
import numpy as np
import pytest

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io.limits import Limits
from napari_crfdeblur.large import open_source

zarr = pytest.importorskip("zarr")
from zarr.codecs import (  # noqa: E402 - only if zarr is there
    BloscCodec,
    Crc32cCodec,
    GzipCodec,
    TransposeCodec,
    ZstdCodec,
)

RANDOM = np.random.default_rng(9)
PHOTO = RANDOM.integers(0, 60000, (70, 90), dtype=np.uint16)
REGION = slice(10, 60), slice(5, 77)
MUCH = 1 << 27  # bytes that a part of 4 kB decodes to

THIRD = {
    "plain": {"compressors": None},
    "gzip": {"compressors": [GzipCodec()]},
    "zstd": {"compressors": [ZstdCodec()]},
    "blosc": {"compressors": [BloscCodec()]},
    "turned": {
        "compressors": [ZstdCodec(), Crc32cCodec()],
        "filters": [TransposeCodec(order=(1, 0))],
    },
    "shards": {"compressors": [ZstdCodec()], "shards": (32, 40), "chunks": (16, 20)},
    "plain shards": {"compressors": None, "shards": (32, 40), "chunks": (16, 20)},
}
SECOND = {
    **{
        each.codec_id: {"compressors": each()}
        for each in (
            *(numcodecs.Zlib, numcodecs.GZip, numcodecs.BZ2),
            *(numcodecs.Zstd, numcodecs.LZ4, numcodecs.Blosc),
        )
    },
    "delta": {"compressors": numcodecs.Zlib(), "filters": [numcodecs.Delta("u2")]},
    "none": {"compressors": None},
}
FORMATS = [(3, kind) for kind in THIRD] + [(2, kind) for kind in SECOND]


def stored(path, form, kind, data=PHOTO):
    options = {"chunks": (32, 40)} | (THIRD if form == 3 else SECOND)[kind]
    zarr.create_array(path, data=data, zarr_format=form, **options)
    return path


def parts(path):
    """Files of the pixels."""
    described = ("zarr.json", ".zarray", ".zattrs", ".zgroup")
    return sorted(p for p in path.rglob("*") if p.is_file() and p.name not in described)


def whole(source):
    return source.read(tuple(slice(0, side) for side in source.shape))


def read_or_refused(path, limits=Limits(large=10**6)):  # noqa: B008 - frozen
    """What was read, or None if it was refused in a printable line that names the folder."""
    try:
        return whole(open_source(path, limits=limits))
    except CrfDeblurError as error:
        said = str(error)
    assert said.isprintable(), ascii(said)
    assert path.name in said
    return None


@pytest.mark.parametrize(("form", "kind"), FORMATS)
def test_arrays_come_back_however_they_are_stored(tmp_path, form, kind):
    source = open_source(stored(tmp_path / "a.zarr", form, kind))
    np.testing.assert_array_equal(source.read(REGION), PHOTO[REGION])
    np.testing.assert_array_equal(whole(source), PHOTO)


def test_parts_that_were_never_written_are_as_they_are_filled(tmp_path):
    zarr.create_array(
        tmp_path / "a.zarr", shape=(70, 90), chunks=(32, 40), dtype="u2", fill_value=7
    )
    np.testing.assert_array_equal(whole(open_source(tmp_path / "a.zarr")), np.full((70, 90), 7))


@pytest.mark.parametrize(("form", "kind"), FORMATS)
def test_damaged_parts_are_pixels_or_one_sentence(tmp_path, form, kind):
    path = stored(tmp_path / "a.zarr", form, kind)
    part, rng = parts(path)[0], np.random.default_rng(31)
    intact = part.read_bytes()
    contents = [intact[: int(share * len(intact))] for share in (0, 0.1, 0.5, 0.99)]
    for _ in range(12):
        changed = bytearray(intact)
        for place in rng.integers(0, min(40, len(intact)), 3):
            changed[place] = rng.integers(0, 256)
        contents.append(bytes(changed))
    for content in contents:
        part.write_bytes(content)
        found = read_or_refused(path)
        assert found is None or (found.shape, found.dtype) == (PHOTO.shape, PHOTO.dtype)


WRONG = [None, -1, 0, 10**30, 1.5, "x", [], {}, [0, 0], [-1, 5], [10**9, 10**9], ["a"], True]


@pytest.mark.parametrize(("form", "kind"), [(3, "gzip"), (3, "shards"), (2, "zlib"), (2, "delta")])
def test_a_description_that_makes_no_sense_is_refused(tmp_path, form, kind):
    path = stored(tmp_path / "a.zarr", form, kind)
    described = path / ("zarr.json" if form == 3 else ".zarray")
    intact = json.loads(described.read_text())
    for text in described_wrongly(intact):
        described.write_text(text)
        found = read_or_refused(path, Limits(large=10**6, chunk=10**6))
        assert found is None or found.size <= 10**6
    for content in (b"", b"\xff\xfe", b"[" * 100_000, b"1" * 9999, b"{}", b"[]", b"null"):
        described.write_bytes(content)
        assert read_or_refused(path) is None


def described_wrongly(intact):
    """Every value of the description, and those within it, replaced."""
    for key, value in intact.items():
        for wrong in WRONG:
            yield json.dumps(intact | {key: wrong})
        yield json.dumps({other: intact[other] for other in intact if other != key})
        for inner in value if isinstance(value, dict) else ():
            for wrong in WRONG:
                yield json.dumps(intact | {key: value | {inner: wrong}})


BOMBS = {
    "gzip": (gzip.compress(bytes(MUCH)), GzipCodec(), 3),
    "zstd": (numcodecs.Zstd().encode(bytes(MUCH)), ZstdCodec(), 3),
    "blosc": (numcodecs.Blosc().encode(bytes(MUCH)), BloscCodec(), 3),
    "zlib": (zlib.compress(bytes(MUCH)), numcodecs.Zlib(), 2),
    "bz2": (bz2.compress(bytes(MUCH)), numcodecs.BZ2(), 2),
    "lz4": (numcodecs.LZ4().encode(bytes(MUCH)), numcodecs.LZ4(), 2),
}
CHILD = """
import json, resource, sys
from pathlib import Path
resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.large import open_source
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
first, *rest = map(Path, sys.argv[1:])
open_source(first).read((slice(0, 9), slice(0, 9)))
before, said = peak(), []
for path in rest:
    try:
        said.append(str(open_source(path).read((slice(0, 9), slice(0, 9)))))
    except CrfDeblurError as error:
        said.append(str(error))
print(json.dumps([said, peak() - before]))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="memory is measured as Linux counts it")
def test_parts_that_inflate_beyond_their_place_take_no_memory(tmp_path):
    folders = [stored(tmp_path / "whole", 3, "zstd")]
    for name, (content, codec, form) in BOMBS.items():
        folders.append(tmp_path / name)
        array = zarr.create_array(
            tmp_path / name,
            shape=(600, 600),
            chunks=(600, 600),
            dtype="u1",
            compressors=codec,
            zarr_format=form,
        )
        array[:] = RANDOM.integers(0, 255, (600, 600), dtype=np.uint8)
        parts(tmp_path / name)[0].write_bytes(content)
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", CHILD, *map(str, folders)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    said, grown = json.loads(done.stdout)
    assert len(said) == len(BOMBS)
    assert all("truncated or damaged" in each for each in said), said
    assert grown < 60  # MB; one of them decodes to 134


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"shape": (10**9, 10**9), "chunks": (100, 100)}, "too large"),
        ({"shape": (30000, 30000), "chunks": (30000, 30000)}, "in smaller parts"),
        ({"shape": (1 << 17, 1 << 17), "chunks": (1, 1), "shards": (1 << 17, 1 << 17)}, "smaller"),
        ({"shape": (70, 90), "dtype": "c8"}, "complex64"),
        ({"shape": (70, 90), "dtype": "i4"}, "int32"),
        ({"shape": (70,)}, "shape"),
        ({"shape": (0, 90)}, "holds no array"),
    ],
)
def test_what_an_array_claims_is_checked_before_it_is_read(tmp_path, change, reason):
    zarr.create_array(tmp_path / "a.zarr", **({"dtype": "u1"} | change))
    with pytest.raises(CrfDeblurError, match=reason):
        open_source(tmp_path / "a.zarr")


class Harmful:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


@pytest.mark.parametrize("place", ["filters", "compressor"])
def test_no_code_is_run_that_an_array_brings(tmp_path, place):
    path = stored(tmp_path / "a.zarr", 2, "none")
    described = json.loads((path / ".zarray").read_text())
    codec = {"id": "pickle"}
    described[place] = [codec] if place == "filters" else codec
    (path / ".zarray").write_text(json.dumps(described))
    for part in parts(path):
        part.write_bytes(pickle.dumps(Harmful(tmp_path / "harm")))
    assert read_or_refused(path) is None
    assert not (tmp_path / "harm").exists()


@pytest.mark.parametrize(
    "codec",
    [
        {"name": "numcodecs.lzma", "configuration": {"preset": 1}},
        {"name": "numcodecs.zfpy", "configuration": {}},
        {"name": "vlen-utf8"},
        {"name": "nothing"},
    ],
)
def test_codecs_that_are_not_bounded_are_refused(tmp_path, codec):
    path = stored(tmp_path / "a.zarr", 3, "plain")
    described = json.loads((path / "zarr.json").read_text())
    described["codecs"].append(codec)
    (path / "zarr.json").write_text(json.dumps(described))
    assert read_or_refused(path) is None


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such files")
@pytest.mark.parametrize("form", [2, 3])
def test_pipes_devices_and_loops_in_a_folder_are_refused(tmp_path, form):
    for number, replaced in enumerate(("part", "description")):
        for kind in ("pipe", "device", "loop"):
            path = stored(tmp_path / f"{number}{kind}", form, "plain" if form == 3 else "none")
            described = path / ("zarr.json" if form == 3 else ".zarray")
            target = parts(path)[0] if replaced == "part" else described
            target.unlink()
            if kind == "pipe":
                os.mkfifo(target)
            else:
                target.symlink_to(target if kind == "loop" else "/dev/zero")
            assert read_or_refused(path) is None


@pytest.mark.parametrize(
    "scales",
    [
        [],
        {},
        3,
        "x",
        [{}],
        [{"datasets": []}],
        [{"datasets": [{"path": 3}]}],
        [{"datasets": [{"path": "../b"}]}],
        [{"datasets": [{"path": "inner"}]}],
        [{"datasets": [{"path": "loop"}]}],
        [{"datasets": [{"path": "a\0b"}]}],
        [{"datasets": [{"path": "x" * 9999}]}],
    ],
)
def test_an_image_whose_scales_are_nowhere_is_refused(tmp_path, scales):
    stored(tmp_path / "b", 3, "plain")
    group = zarr.create_group(tmp_path / "a")
    group.create_group("inner")
    if sys.platform != "win32":
        (tmp_path / "a" / "loop").symlink_to(tmp_path / "a", target_is_directory=True)
    group.attrs["multiscales"] = scales
    assert read_or_refused(tmp_path / "a") is None


def test_an_array_of_numpy_that_is_cut_short_while_it_is_read_is_refused(tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, PHOTO)
    source = open_source(path)
    stamp = path.stat()
    path.write_bytes(path.read_bytes()[:-9000])
    os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    with pytest.raises(CrfDeblurError, match="changed"):
        source.read(REGION)


@pytest.mark.parametrize("shape", [(5, 7), (4, 5, 7), (4, 5, 7, 3), (2, 3, 5, 7, 4)])
@pytest.mark.parametrize("order", ["C", "F"])
def test_any_region_of_an_array_of_numpy_is_read(tmp_path, shape, order):
    values = np.asarray(RANDOM.random(shape).astype(">f4"), order=order)
    np.save(tmp_path / "a.npy", values)
    source = open_source(tmp_path / "a.npy")
    for _ in range(30):
        region = tuple(slice(*np.sort(RANDOM.integers(0, side + 1, 2))) for side in shape)
        found = source.read(region)
        np.testing.assert_array_equal(found, values[region])
        assert found.dtype.isnative
