"""What arguments of the command line can be: texts that become numbers, sizes, files and names."""

import re
from argparse import ArgumentTypeError
from collections.abc import Callable
from pathlib import Path

from ..texts import printable

LONGEST_SIDE = 16384  # rows or columns of a simulated photo
MOST_PIXELS = 1 << 26  # of a simulated photo: some GB of memory while it is made
LARGEST_PSF = 999  # rows or columns: the search for a larger one takes hours
SMALLEST_BOX = 7  # pixels around a point, so that ground is seen beside it
LARGEST_EXTENT = 9999.0  # pixels that an edge can be blurred over
MOST_PARTS = 99  # rows or columns of parts with a PSF of their own
LARGEST_SEED = 2**32 - 1
LARGEST_TURN = 10.0  # degrees: beyond, the corners of the photo come from far outside of it
LARGEST_NOISE = 1.0  # standard deviation as large as the range of irradiance
LONGEST_NAME = 100  # characters of a camera or of what is added to the name of a file

SCHEDULER = re.compile(r"(tcp://)?(\[[0-9A-Fa-f:.%]+\]|[A-Za-z0-9._-]+):([0-9]{1,5})")
LARGEST_PORT = 65535


def between(low: float, high: float, *, above: bool = False) -> Callable[[str], float]:
    """Numbers from `low` to `high`; with `above`, without `low` itself."""

    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high or (above and value == low):
            span = f"above {low:g} and at most {high:g}" if above else f"from {low:g} to {high:g}"
            raise ArgumentTypeError(f"expected a number {span}, got {_short(text)}")
        return value

    return number


extent = between(0, LARGEST_EXTENT, above=True)
turn = between(-LARGEST_TURN, LARGEST_TURN)
noise = between(0, LARGEST_NOISE)


def seed_number(text: str) -> int:
    """A whole number that draws another scene."""
    value = _whole(text)
    if value is None or value > LARGEST_SEED:
        raise ArgumentTypeError(
            f"expected a whole number from 0 to {LARGEST_SEED}, got {_short(text)}"
        )
    return value


def name(text: str) -> str:
    """The name of a camera, without spaces beyond those between its words."""
    name = " ".join(text.split())
    if not name:
        raise ArgumentTypeError("expected the name of a camera, got none")
    return _plain(name)


def suffix(text: str) -> str:
    """What is added to the names of files."""
    return _plain(text)


def odd_pixels(text: str) -> int:
    """A size in pixels, at least 3; an even one becomes the next odd one."""
    value = _whole(text)
    if value is None or not 3 <= value <= LARGEST_PSF:
        raise ArgumentTypeError(
            f"expected a whole number of pixels from 3 to {LARGEST_PSF}, got {_short(text)}"
        )
    return value | 1


def size(text: str) -> tuple[int, int]:
    """Rows and columns of a photo."""
    pair = _pair(text)
    if pair is None or not all(64 <= side <= LONGEST_SIDE for side in pair):
        raise ArgumentTypeError(
            f"expected ROWSxCOLUMNS of 64 to {LONGEST_SIDE} each, got {_short(text)}"
        )
    if pair[0] * pair[1] > MOST_PIXELS:
        raise ArgumentTypeError(
            f"expected at most {MOST_PIXELS / 1e6:.0f} megapixels, got {_short(text)}"
        )
    return pair


def box(text: str) -> tuple[float, float, int]:
    """Row, column and size of a box in a photo; an even size becomes the next odd one."""
    parts = [_whole(part.strip()) for part in text.split(",")]
    numbers = [part for part in parts if part is not None]
    if len(parts) != 3 or len(numbers) != 3 or not SMALLEST_BOX <= numbers[2] <= LARGEST_PSF:
        raise ArgumentTypeError(
            f"expected ROW,COLUMN,SIZE in whole pixels, SIZE from {SMALLEST_BOX} to "
            f"{LARGEST_PSF}, got {_short(text)}"
        )
    return float(numbers[0]), float(numbers[1]), numbers[2] | 1


def grid(text: str) -> tuple[int, int]:
    """Rows and columns of parts."""
    pair = _pair(text)
    if pair is None or min(pair) < 1 or max(pair) > MOST_PARTS:
        raise ArgumentTypeError(
            f"expected ROWSxCOLUMNS of parts, 1 to {MOST_PARTS} each, got {_short(text)}"
        )
    return pair


def file_name(text: str) -> Path:
    """A file or a folder."""
    return Path(word(text))


def word(text: str) -> str:
    """The name of a file, or one of the words that an option knows."""
    if not text or "\0" in text:
        raise ArgumentTypeError(f"expected a name, got {_short(text) or 'an empty text'}")
    return text


def address(text: str) -> str:
    """Where a scheduler of dask.distributed listens."""
    found = SCHEDULER.fullmatch(text)
    if found is None or not 0 < int(found[3]) <= LARGEST_PORT:
        raise ArgumentTypeError(
            f"expected the address of a scheduler, such as tcp://host:8786, got {_short(text)}"
        )
    return text


def _whole(text: str) -> int | None:
    return int(text) if re.fullmatch(r"[0-9]{1,10}", text) else None


def _pair(text: str) -> tuple[int, int] | None:
    first, _, second = text.partition("x")
    rows, columns = _whole(first), _whole(second)
    return None if rows is None or columns is None else (rows, columns)


def _plain(text: str) -> str:
    if printable(text) != text or len(text) > LONGEST_NAME:
        raise ArgumentTypeError(
            f"expected at most {LONGEST_NAME} characters that can be seen, got {_short(text)}"
        )
    return text


def _short(text: str) -> str:
    """The beginning of an argument, which can be as long as it likes."""
    return text if len(text) <= 40 else f"{text[:40]}..."
