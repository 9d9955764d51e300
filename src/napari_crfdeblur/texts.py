"""Texts of others, such as names of files, made fit to be shown on one line."""

import unicodedata

# Control characters, formats such as those that turn the direction of writing, surrogates that
# stand for bytes that are no text, and separators of lines and paragraphs.
HARMFUL = ("Cc", "Cf", "Cs", "Zl", "Zp")


def printable(text: str) -> str:
    r"""The text with every character that could do more than be seen as its escape, ``\x1b``."""
    return "".join(
        each.encode("unicode_escape").decode("ascii")
        if unicodedata.category(each) in HARMFUL
        else each
        for each in text
    )
