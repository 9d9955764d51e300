"""The command ``crfdeblur``."""

from collections.abc import Sequence

from .stopping import Stopping

FAILED = 2
IN_PART = 1


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns 0, or 2 after one sentence about what went wrong.

    A batch of which some photos were passed over returns 1.

    Parameters
    ----------
    argv : sequence of str, optional
        By default those of the program, which then ends: Ctrl-C has nothing to stop any more.
    """
    code = None
    try:
        with Stopping(last=argv is None) as stopping:
            try:
                with stopping.allowed():
                    code = _run(argv)
            except KeyboardInterrupt:
                code = _stopped()
    except KeyboardInterrupt:  # in the moment before Ctrl-C is heard, or that after it
        pass
    return _stopped() if code is None else code


def _stopped() -> int:
    from .terminal import complain

    complain("stopped; no file was left half written, so start again when you like")
    return FAILED


def _run(argv: Sequence[str] | None) -> int:
    """Read the arguments, and do what they say.

    Numpy and the stages are loaded only after the arguments have been read, so that help
    comes at once; and as a whole, since what is loaded in part misleads what comes after it.
    """
    from ..errors import REFUSALS, in_words
    from ..interrupts import uninterrupted
    from .parser import parse
    from .terminal import complain, silent_libraries

    with silent_libraries():
        try:
            arguments = parse(argv)
            with uninterrupted():
                from . import commands
            complete = getattr(commands, arguments.command)(arguments)
        except REFUSALS as error:
            Stopping.check()
            complain(in_words(error))
            return FAILED
    return IN_PART if complete is False else 0
