"""Files that nobody vouches for, made from valid ones, and what may come of reading them."""

import json
import warnings
from copy import deepcopy

from napari_crfdeblur.errors import CrfDeblurError

LONG = "x" * 3000
# What may stand at any place of a JSON document instead of what belongs there.
WRONG = [
    None,
    True,
    -1,
    0,
    10**400,
    -(10**299),
    1e308,
    float("nan"),
    float("-inf"),
    "",
    "\x1b[31mred\u202e\ud800",
    LONG,
    [],
    {},
    [[[[]]]],
    {"type": "array", "dtype": "float64", "shape": [10**9, 10**9], "data": [1]},
    {"type": "Gamma"},
    {"type": LONG},
    [0] * 1000,
    [10**400, 1],
    [None, "1"],
]


def read_or_refused(read, path):
    """What was read, or None if it was refused: in one printable line that names the file."""
    before = sorted(path.parent.rglob("*"))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return read(path)
    except CrfDeblurError as error:
        said = str(error)
        assert said.isprintable(), ascii(said)
        assert path.name in said, said
        assert len(said) < len(str(path)) + 700, said
        return None
    finally:
        assert sorted(path.parent.rglob("*")) == before


def truncated(content, rng, count):
    """Beginnings of a file."""
    yield from (content[: int(rng.integers(0, len(content)))] for _ in range(count))


def flipped(content, rng, count, header=200):
    """A file with a few other bytes, most of them near its beginning."""
    for _ in range(count):
        changed = bytearray(content)
        for _ in range(int(rng.integers(1, 5))):
            far = len(content) if rng.random() < 0.2 else min(header, len(content))
            changed[int(rng.integers(0, far))] = int(
                rng.choice([0, 1, 127, 128, 255, rng.integers(256)])
            )
        yield bytes(changed)


def places(document, at=()):
    """Keys that lead to every value of a document; of long lists, to the first and last ones."""
    yield at
    if isinstance(document, dict):
        for key in document:
            yield from places(document[key], (*at, key))
    if isinstance(document, list):
        for index in sorted({*range(len(document))[:2], *range(len(document))[-1:]}):
            yield from places(document[index], (*at, index))


def with_value(document, place, value):
    """The document with another value at a place."""
    if not place:
        return value
    changed = deepcopy(document)
    inner = changed
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    return changed


def without(document, place):
    """The document without what is at a place."""
    changed = deepcopy(document)
    inner = changed
    for key in place[:-1]:
        inner = inner[key]
    del inner[place[-1]]
    return changed


def documents(document, rng, count):
    """Texts of the document with wrong values at its places, and with things left out."""
    found = list(places(document))
    for place in found[1:]:
        yield json.dumps(without(document, place))
    for _ in range(count):
        place = found[int(rng.integers(len(found)))]
        value = WRONG[int(rng.integers(len(WRONG)))]
        yield json.dumps(with_value(document, place, value))


NO_JSON = [
    b"",
    b"\xff\xfe\x00",
    b"\xef\xbb\xbf",
    b"{}" * 2,
    b'{"a": 1, "a": 2}',
    b"NaN",
    b"-Infinity",
    b"\0" * 100,
    b'"\xed\xa0\x80"',
    b"[" * 200_000,
    b'{"a":' * 100_000,
    b"[" * 300 + b"]" * 300,
    b"1" * 10_000,
    b"[" + b"9" * 400 + b"]",
    b"1e999",
    b"1." + b"0" * 5000,
    b"'text'",
    b'"open',
    b"\x1b[31m",
]
