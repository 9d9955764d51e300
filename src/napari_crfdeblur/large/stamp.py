"""Whether a file is still what it was when the work began."""

from dataclasses import dataclass
from pathlib import Path

from ..errors import CrfDeblurError


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
            files = [path, *path.rglob("*")] if path.is_dir() else [path]
            found = [each.stat() for each in files]
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
