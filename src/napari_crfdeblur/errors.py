"""The one error that a photograph can cause, and what is said of those that others raise."""

import struct
import zlib
from tokenize import TokenError

from .texts import printable


class CrfDeblurError(Exception):
    """A photo, PSF or file that does not permit the step; the message says what to do.

    It is one line that can be printed, whatever names and texts of files are in it.
    """

    def __str__(self) -> str:
        return printable(super().__str__())


def about(name: object, error: BaseException) -> CrfDeblurError:
    """The same refusal, with the name of the file or layer that it is about before it, once."""
    text = str(error)
    return CrfDeblurError(text if text.startswith(str(name)) else f"{name}: {text}")


DAMAGED = (
    ArithmeticError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    OSError,
    RecursionError,
    RuntimeError,
    SyntaxError,
    TokenError,
    TypeError,
    ValueError,
    struct.error,
    zlib.error,
)
"""What decoders and constructors raise for content that ends early or makes no sense."""

REFUSALS = (CrfDeblurError, ValueError, OverflowError, OSError, MemoryError)
"""What a photo, a file, a disk or an argument can do wrong: said in a sentence, no traceback."""


def in_words(error: BaseException) -> str:
    """The sentence that a user reads of one of the :data:`REFUSALS`.

    Parameters
    ----------
    error : Exception
        One of :data:`REFUSALS`.
    """
    if isinstance(error, MemoryError):
        return "there is not enough memory; use a smaller photo or a part of it"
    if isinstance(error, OSError):
        name = f"{error.filename}: " if error.filename else ""
        return printable(f"{name}{error.strerror or error}; check the file and the disk")
    return printable(str(error))
