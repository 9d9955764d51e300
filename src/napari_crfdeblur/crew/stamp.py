"""Whether a file is still what it was when the work began."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..errors import CrfDeblurError

# What a group or an array has in its folder, in either version of the format.
ZARR_FILES = ("zarr.json", ".zarray", ".zgroup")
MOST_FILES = 1 << 20  # to look at them all takes seconds; a terabyte in chunks of a megabyte


@dataclass(frozen=True, slots=True)
class Stamp:
    """Size and time of the last change of a file, or of all files in a folder.

    Parameters
    ----------
    path : Path
    size : int
        In bytes.
    changed : int
        Time in nanoseconds.
    """

    path: Path
    size: int
    changed: int

    @classmethod
    def of(cls, path: Path) -> "Stamp":
        """The stamp of a file or folder as it is now."""
        try:
            found = list(_facts(path))
        except OSError as error:
            raise CrfDeblurError(
                f"{path}: cannot be read ({error.strerror}); if it is read by other machines, "
                "put it where all of them find it under this name"
            ) from error
        return cls(path, sum(s.st_size for s in found), max(s.st_mtime_ns for s in found))

    def check(self) -> None:
        """Refuse to go on with a file that has changed.

        Raises
        ------
        CrfDeblurError
            It was changed or taken away.
        """
        if Stamp.of(self.path) != self:
            raise CrfDeblurError(
                f"{self.path}: was changed while it was read; start again when it is complete"
            )


def check_zarr(folder: Path) -> None:
    """Refuse a folder that holds no zarr, without a look at what else is in it."""
    if not any((folder / name).is_file() for name in ZARR_FILES):
        raise CrfDeblurError(
            f"{folder}: this folder holds no array of zarr; give a file or such a folder"
        )


def _facts(path: Path) -> Iterator[os.stat_result]:
    """What the system says of a file, or of a folder of zarr and all in it, links not followed."""
    yield path.stat()
    if not path.is_dir():
        return
    check_zarr(path)
    count = 0
    for folder, folders, files in os.walk(path, onerror=_raise):
        count += len(folders) + len(files)
        if count > MOST_FILES:
            raise CrfDeblurError(
                f"{path}: holds more than {MOST_FILES} files; store it in larger chunks"
            )
        for name in (*folders, *files):
            yield Path(folder, name).stat()


def _raise(error: OSError) -> None:
    raise error
