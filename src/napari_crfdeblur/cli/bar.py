"""A progress bar for a terminal."""

import sys
import time

from ..progress import Job, Progress, T, drain
from ..texts import printable
from .stopping import Stopping
from .terminal import is_shown, put

WIDTH = 24
SECONDS_BETWEEN = 0.05


class Bar:
    """Shows progress on standard error, if that is a terminal."""

    def __init__(self) -> None:
        self._shown = is_shown(sys.stderr)
        self._last = 0.0

    def __call__(self, progress: Progress) -> None:
        """Draw the bar anew, at most 20 times a second; stop if Ctrl-C was pressed."""
        Stopping.check()
        now = time.monotonic()
        if not self._shown or now - self._last < SECONDS_BETWEEN:
            return
        self._last = now
        full = WIDTH * progress.done // max(progress.total, 1)
        line = f"[{'#' * full}{'.' * (WIDTH - full)}] {printable(progress.stage)}"
        put(sys.stderr, f"\r{line:<79.79}")

    def clear(self) -> None:
        """Take the bar away."""
        if self._shown:
            put(sys.stderr, f"\r{'':79}\r")


def run(job: Job[T]) -> T:
    """Run a job to its end under a progress bar."""
    bar = Bar()
    try:
        return drain(job, bar)
    finally:
        bar.clear()
