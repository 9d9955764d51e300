"""Ctrl-C: heard from the first moment of the command to its last, and once."""

import signal
from threading import current_thread, main_thread
from types import FrameType, TracebackType
from typing import Any, ClassVar


class Stopping:
    """What Ctrl-C does while the command runs.

    The first one raises KeyboardInterrupt inside :meth:`allowed`. Those that follow are not
    heard, so that what cleans up after the first is not stopped itself.

    Parameters
    ----------
    last : bool
        Whether the program ends with the command: Ctrl-C is not heard from then on.
    """

    _now: ClassVar["Stopping | None"] = None

    def __init__(self, *, last: bool) -> None:
        self._last = last
        self._before: Any = None
        self._asked = self._allowed = False

    def __enter__(self) -> "Stopping":
        Stopping._now = self
        if current_thread() is main_thread():  # Python hands signals to no other
            self._before = signal.signal(signal.SIGINT, self._hear)
        return self

    def __exit__(self, *_: object) -> None:
        Stopping._now = None
        if self._before is not None:
            signal.signal(signal.SIGINT, signal.SIG_IGN if self._last else self._before)

    def allowed(self) -> "_Allowed":
        """Where Ctrl-C raises KeyboardInterrupt, in a ``with``."""
        return _Allowed(self)

    @classmethod
    def check(cls) -> None:
        """Stop now if Ctrl-C was pressed: some libraries catch what it raises."""
        if cls._now is not None and cls._now._asked:
            raise KeyboardInterrupt

    def _hear(self, _number: int, _frame: FrameType | None) -> None:
        first = not self._asked
        self._asked = True
        if first and self._allowed:
            raise KeyboardInterrupt


class _Allowed:
    def __init__(self, stopping: Stopping) -> None:
        self._stopping = stopping

    def __enter__(self) -> None:
        self._stopping._allowed = True
        Stopping.check()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self._stopping._allowed = False
        if self._stopping._asked and kind is not None and issubclass(kind, Exception):
            # What was made of it by a library that was interrupted.
            raise KeyboardInterrupt from error
