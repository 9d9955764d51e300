"""What the command says, to a terminal, a file or a pipe: printing never fails."""

import logging
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

from ..texts import printable


def say(text: str) -> None:
    """Print a line on standard output."""
    put(sys.stdout, f"{printable(text)}\n")


def complain(sentence: str) -> None:
    """Print the one line on standard error that tells why the command has ended."""
    put(sys.stderr, f"crfdeblur: {printable(sentence)}\n")


def put(stream: TextIO | None, text: str) -> None:
    """Write a text, with what the encoding of the stream lacks as escapes.

    A reader that has gone away, or a disk that is full, has nobody read it: that is no reason
    to end the work.
    """
    if stream is None:  # a program without a console has none
        return
    encoding = stream.encoding or "utf-8"
    try:
        stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
        stream.flush()
    except (OSError, ValueError):
        _silence(stream)


def is_shown(stream: TextIO | None) -> bool:
    """Whether a stream leads to a terminal."""
    with suppress(OSError, ValueError):  # closed
        return stream is not None and stream.isatty()
    return False


def _silence(stream: TextIO) -> None:
    """Lead a stream to nowhere, so that nothing fails when the program ends, either."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


@contextmanager
def silent_libraries() -> Iterator[None]:
    """Keep what libraries log and warn of off the terminal.

    Whoever makes errors of warnings still gets them.
    """
    logged, warned, unraisable = (
        logging.root.manager.disable,
        warnings.showwarning,
        sys.unraisablehook,
    )
    logging.disable(logging.CRITICAL)
    warnings.showwarning = lambda *_, **__: None
    sys.unraisablehook = _but_interrupts
    try:
        yield
    finally:
        logging.disable(logged)
        warnings.showwarning, sys.unraisablehook = warned, unraisable


def _but_interrupts(raised: "sys.UnraisableHookArgs") -> None:
    """Say nothing of Ctrl-C where it cannot stop anything: it is asked for at the next report."""
    if not issubclass(raised.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(raised)
