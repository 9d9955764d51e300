"""Files that are opened to be read: regular ones alone, which end, and keep nobody waiting."""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from ..errors import CrfDeblurError
from ..texts import brief
from .files import check_input

# A pipe is opened without waiting for what writes it, and then refused; Windows has none.
AT_ONCE = getattr(os, "O_NONBLOCK", 0)


@contextmanager
def open_input(path: Path) -> Iterator[BinaryIO]:
    """Open a file to read it.

    Raises
    ------
    CrfDeblurError
        Missing, no file, or it may not be read.
    """
    check_input(path)
    try:
        file = open(path, "rb", opener=_opener)  # noqa: SIM115 - pathlib takes no opener
    except OSError as error:  # since it was looked at, it was taken away, or locked
        raise CrfDeblurError(f"{path}: cannot be opened ({error.strerror}); try again") from error
    with file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise CrfDeblurError(f"{path}: this is a pipe or a device, not a file; give a file")
        yield file


def _opener(name: str, flags: int) -> int:
    return os.open(name, flags | AT_ONCE)


def is_folder(path: Path) -> bool:
    """Whether there is a folder of this name; none has a name that is too long."""
    try:
        return path.is_dir()
    except OSError:
        return False


def size_of(file: BinaryIO) -> int:
    """Bytes of an open file."""
    return os.fstat(file.fileno()).st_size


def read_bytes(path: Path, most: int) -> bytes:
    """The content of a file of at most so many bytes.

    Raises
    ------
    CrfDeblurError
        As :func:`open_input`; too large, or the disk fails.
    """
    with open_input(path) as file:
        try:
            # Of a file that grows meanwhile, one byte too many is enough to know.
            content = file.read(most + 1) if size_of(file) <= most else None
        except OSError as error:
            raise CrfDeblurError(f"{path}: cannot be read ({error.strerror})") from error
    if content is None or len(content) > most:
        raise CrfDeblurError(
            f"{path}: is larger than {most / 1e6:.0f} MB, too large for a file of this kind; "
            "check that it is the right one"
        )
    return content


def damaged(path: Path, what: str, error: Exception, advice: str) -> CrfDeblurError:
    """What is said of a file whose content a decoder refused.

    Parameters
    ----------
    path : Path
    what : str
        What is wrong with it, such as "the image is truncated or damaged".
    error : Exception
        One of :data:`~napari_crfdeblur.errors.DAMAGED`.
    advice : str
        What to do.
    """
    if isinstance(error, MemoryError):
        return CrfDeblurError(
            f"{path}: there is not enough memory to read this file; make it smaller, or use a "
            "machine that has more"
        )
    return CrfDeblurError(f"{path}: {what} ({brief(error)}); {advice}")
