"""The command ``crfdeblur``."""

import sys
from collections.abc import Sequence

from ..errors import CrfDeblurError
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
    except (CrfDeblurError, ValueError) as error:
        return _fail(str(error))
    except OSError as error:
        name = f"{error.filename}: " if error.filename else ""
        return _fail(f"{name}{error.strerror or error}; check the file and the disk")
    except MemoryError:
        return _fail("there is not enough memory; use a smaller photo or a part of it")
    except KeyboardInterrupt:
        return _fail("stopped; no file was left half written, so start again when you like")
    return IN_PART if complete is False else 0


def _fail(sentence: str) -> int:
    print(f"crfdeblur: {sentence}", file=sys.stderr)
    return FAILED
