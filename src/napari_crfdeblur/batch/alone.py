"""One batch at a time in a folder: those of this process wait, those of others are refused."""

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Lock

from ..errors import CrfDeblurError
from ..progress import Job, Progress

NAME = ".crfdeblur-lock"
TICK = 0.05  # seconds between two looks at whether another batch has ended
TAKEN = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)  # what systems say of a file locked by others
# A batch that was cancelled ends at its next report only; the next one in its folder waits.
_LOCKS: dict[Path, Lock] = {}


def taking_turn(folder: Path) -> Job[Lock]:
    """Job: wait for the other batches of this process in a folder; the lock is to be released."""
    lock = _LOCKS.setdefault(folder.resolve(), Lock())
    while not lock.acquire(timeout=TICK):
        yield Progress("waiting for another batch in this folder", 0, 1)
    return lock


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Keep batches of other processes, and of other machines, out of a folder.

    The operating system holds the lock and drops it with the process, however that ends. Where a
    file system knows no locks, there is none.

    Raises
    ------
    CrfDeblurError
        Another batch is at work in the folder.
    """
    path = folder / NAME
    file = _locked(path)
    try:
        yield
    finally:
        if sys.platform == "win32":
            os.close(file)  # an open file cannot be taken away there
        with suppress(OSError):
            path.unlink()
        if sys.platform != "win32":
            os.close(file)


def _locked(path: Path) -> int:
    """An open file of this name that nobody else has locked."""
    while True:
        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock(file)
            if _is_at(path, file):
                return file
        except OSError as error:
            if error.errno not in TAKEN:
                return file
            os.close(file)
            raise CrfDeblurError(
                f"{path.parent}: another batch is at work in this folder; wait until it has "
                "ended, or choose another folder"
            ) from error
        os.close(file)  # that of a batch which ended just now


def _is_at(path: Path, file: int) -> bool:
    """Whether the file still has its name."""
    try:
        return os.path.samestat(path.stat(), os.fstat(file))
    except FileNotFoundError:
        return False


if sys.platform == "win32":
    import msvcrt

    def _lock(file: int) -> None:
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(file: int) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
