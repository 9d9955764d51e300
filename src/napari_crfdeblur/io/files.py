"""Files that are whole or not there: checked before the work, replaced in one step after it."""

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from ..errors import CrfDeblurError
from ..interrupts import uninterrupted
from .places import Place, resolved, unwritable


def check_input(path: Path) -> None:
    """Refuse a file that is missing, is no file or cannot be read."""
    if not _exists(path):
        raise CrfDeblurError(f"{path}: there is no such file; check the name")
    if path.is_dir():
        raise CrfDeblurError(f"{path}: this is a folder; give a file in it")
    if not path.is_file():
        raise CrfDeblurError(f"{path}: this is a pipe or a device, not a file; give a file")
    if not os.access(path, os.R_OK):
        raise CrfDeblurError(f"{path}: may not be read; change its permissions")


def check_output(path: Path, suffixes: Sequence[str]) -> None:
    """Refuse, before any work, an output that could not be written.

    Parameters
    ----------
    path : Path
        File to be written.
    suffixes : sequence of str
        Kinds of file that can be written, such as ``.png``.
    """
    if path.suffix.lower() not in suffixes:
        raise CrfDeblurError(
            f"{path}: cannot write this kind of file; choose a name that ends in "
            + ", ".join(suffixes)
        )
    if _exists(path):
        if path.is_dir():
            raise CrfDeblurError(f"{path}: is a folder; give the name of a file")
        if not path.is_file():
            raise CrfDeblurError(f"{path}: is a pipe or a device; give the name of a file")
    check_folder(resolved(path).parent if path.is_symlink() else path.parent)


def _exists(path: Path) -> bool:
    """Whether there is such a file or folder; refuses names that no file can have."""
    try:
        return path.exists()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise CrfDeblurError(f"{path}: {reason}; choose another name") from error


def check_folder(folder: Path) -> None:
    """Refuse a folder that is missing or in which nothing can be written."""
    if not folder.is_dir():
        raise CrfDeblurError(f"{folder}: there is no such folder; make it first")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise CrfDeblurError(
            f"{folder}: nothing can be written in this folder ({error.strerror}); choose another"
        ) from error


def make_folder(folder: Path) -> None:
    """Make a folder and its parents if they are missing, and check that it can be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CrfDeblurError(
            f"{folder}: cannot make this folder ({error.strerror}); choose another"
        ) from error
    check_folder(folder)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Name of a file or folder to be written, which takes the place of `path` if all goes well.

    A run that fails or is stopped leaves what was there before. A link stays a link.
    """
    place = Place(path)
    try:
        yield place.make()
        with uninterrupted():
            try:
                place.appear()
            except OSError:
                place.back()
                raise
    except OSError as error:
        raise unwritable(path, error) from error
    finally:
        place.drop()


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
