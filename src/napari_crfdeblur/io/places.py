"""The place of one output: written beside it, and there at once when it is whole."""

import os
import shutil
import weakref
from contextlib import suppress
from pathlib import Path
from secrets import token_hex

from ..errors import CrfDeblurError
from ..interrupts import uninterrupted

PREFIX = ".crfdeblur-"


class Place:
    """Where a file or a folder will be; until then it is written in a folder beside that.

    A process that is killed leaves what was there before, or the new one, whole; in a moment
    that the file system knows no single step for, the old one is in the folder beside.

    Parameters
    ----------
    path : Path
        As the user calls it. A link stays a link.

    Raises
    ------
    CrfDeblurError
        A link that leads in a circle.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.target = resolved(path)
        self._aside = self.target.parent / f"{PREFIX}{token_hex(8)}"
        self._there = False
        self.new = self._aside / "new" / path.name
        self._old = self._aside / "old"
        # Known before it is made, so that nothing is left whenever the process ends.
        self._drop = weakref.finalize(self, shutil.rmtree, self._aside, ignore_errors=True)

    def make(self) -> Path:
        """Make room; the name under which the new file or folder is to be written."""
        try:
            self._aside.mkdir(mode=0o700, exist_ok=True)
            self.new.parent.mkdir(exist_ok=True)
        except OSError as error:
            raise unwritable(self.path, error) from error
        return self.new

    def appear(self) -> None:
        """Put what was written in its place, and what was there aside."""
        if not os.path.lexists(self.new):
            return
        if os.path.lexists(self.target):
            self._set_aside()
        self.new.replace(self.target)
        self._there = True

    def back(self) -> None:
        """Undo :meth:`appear`, as far as it came.

        Raises
        ------
        CrfDeblurError
            It cannot be undone; what was there before is kept aside.
        """
        try:
            if self._there and (self.target.is_dir() or not self._old.exists()):
                self.target.rename(self.new)
            if self._old.exists() and self._there:
                self._old.replace(self.target)
            elif self._old.exists() and not self.target.exists():
                self._old.rename(self.target)
        except OSError as error:
            self._drop.detach()
            raise CrfDeblurError(
                f"{self.path}: cannot be written ({error.strerror or error}); what was there "
                f"before is {self._old}: put it back"
            ) from error

    def drop(self) -> None:
        """Take away what is beside the place."""
        with uninterrupted():
            self._drop()

    def _set_aside(self) -> None:
        if self.target.is_dir():
            self.target.rename(self._old)
            return
        self.new.chmod(self.target.stat().st_mode & 0o777)
        # A second name, so that there is a file under the first one at any time.
        with suppress(OSError):
            os.link(self.target, self._old)
            return
        self.target.rename(self._old)


def resolved(path: Path) -> Path:
    """Where a path leads by all its links.

    Raises
    ------
    CrfDeblurError
        In a circle, or nowhere at all.
    """
    try:
        target = path.resolve()
        target.lstat()
        circle = target.is_symlink()  # newer versions of Python leave it as it is
    except (FileNotFoundError, NotADirectoryError):
        return target
    except RuntimeError:
        circle = True
    except OSError as error:
        raise unwritable(path, error) from error
    if circle:
        raise CrfDeblurError(f"{path}: is a link that leads in a circle; choose another name")
    return target


def unwritable(path: Path, error: OSError) -> CrfDeblurError:
    """What is said of an output that could not be written."""
    # Encoders raise it with a text alone.
    return CrfDeblurError(f"{path}: cannot be written ({error.strerror or error})")
