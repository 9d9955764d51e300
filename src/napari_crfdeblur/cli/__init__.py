"""The command ``crfdeblur``."""

import sys
from collections.abc import Sequence

from ..errors import REFUSALS, in_words
from .parser import parse

FAILED = 2
IN_PART = 1


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns 0, or 2 after one sentence about what went wrong.

    A batch of which some photos were passed over returns 1.

    Numpy and the stages are loaded only after the arguments have been read, so that help
    comes at once.
    """
    arguments = parse(argv)
    try:
        from . import commands

        complete = getattr(commands, arguments.command)(arguments)
    except REFUSALS as error:
        return _fail(in_words(error))
    except KeyboardInterrupt:
        return _fail("stopped; no file was left half written, so start again when you like")
    return IN_PART if complete is False else 0


def _fail(sentence: str) -> int:
    print(f"crfdeblur: {sentence}", file=sys.stderr)
    return FAILED
