"""Texts from files and names of files, as they are put into a sentence for a user."""

from unicodedata import category

LONGEST = 200  # characters of what a library says; enough for its point, and for one look
SPACES = "Zs"  # kinds of space; file names have them, and they do no harm


def printable(text: str) -> str:
    """The text on one line: what would move the cursor, hide or turn text is written as its code.

    Parameters
    ----------
    text : str
        Such as the name of a file or of a camera: with line breaks, control characters, marks
        of direction, or bytes that are no text.
    """
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() or category(each) == SPACES else ascii(each)[1:-1]
        for each in text
    )


def brief(content: object) -> str:
    """The beginning of what an error or a value says, on one line.

    Parameters
    ----------
    content : object
        An error that a library raised, or a value that a file holds.
    """
    text = content[: LONGEST + 1] if isinstance(content, str) else str(content)
    plain = printable(text)
    return plain if len(plain) <= LONGEST else f"{plain[:LONGEST]}..."
