"""One batch at a time in a folder: those of this process wait, those of others are refused."""

import errno
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Lock

from filelock import FileLock, Timeout

from ..errors import CrfDeblurError
from ..progress import Job, Progress

NAME = ".crfdeblur-lock"
TICK = 0.05  # seconds between two looks at whether another batch has ended
UNKNOWN = (errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP)  # what file systems without locks say
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
    # A batch may end in another thread than it began in. A file in place of a lock would stay
    # behind a process that is killed.
    lock = FileLock(path, timeout=0, thread_local=False, fallback_to_soft=False)
    try:
        lock.acquire()
    except Timeout as error:
        raise CrfDeblurError(
            f"{folder}: another batch is at work in this folder; wait until it has ended, or "
            "choose another folder"
        ) from error
    except OSError as error:
        if error.errno not in UNKNOWN:
            raise
    try:
        yield
    finally:
        if sys.platform != "win32":  # there, an open file cannot be taken away; the release does
            with suppress(OSError):
                path.unlink()
        lock.release()
