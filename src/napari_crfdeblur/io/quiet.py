"""Libraries that read files are kept from speaking beside the sentence that a user gets."""

import logging
import threading
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

LOGGERS = ("tifffile", "PIL", "zarr", "numcodecs", "imagecodecs")

_lock = threading.Lock()
_readers = 0
_silence = ExitStack()


@contextmanager
def quiet() -> Iterator[None]:
    """Leave out warnings and log lines of the libraries that read files, as long as this lasts.

    Warnings can only be left out in all threads. Those that read at a time share it, and the
    last one to end puts back what was there before the first.
    """
    global _readers
    with _lock:
        if not _readers:
            _begin()
        _readers += 1
    try:
        yield
    finally:
        with _lock:
            _readers -= 1
            if not _readers:
                _silence.close()


def _begin() -> None:
    _silence.enter_context(warnings.catch_warnings())
    warnings.simplefilter("ignore")
    for name in LOGGERS:
        _silence.enter_context(_muted(logging.getLogger(name)))


@contextmanager
def _muted(logger: logging.Logger) -> Iterator[None]:
    """Keep the lines of a logger, and of those below it, from handlers that are not its own."""
    nowhere, before = logging.NullHandler(), logger.propagate
    logger.addHandler(nowhere)
    logger.propagate = False
    try:
        yield
    finally:
        logger.propagate = before
        logger.removeHandler(nowhere)
