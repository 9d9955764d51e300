"""What arguments of the command line can be: texts that become numbers, sizes and names."""

from argparse import ArgumentTypeError


def positive(text: str) -> float:
    """A finite number above 0."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise ArgumentTypeError(f"expected a positive number, got {text}")
    return value


def name(text: str) -> str:
    """The name of a camera, without spaces beyond those between its words."""
    name = " ".join(text.split())
    if not name:
        raise ArgumentTypeError("expected the name of a camera, got none")
    return name


def odd(text: str) -> int:
    """A size in pixels, at least 3; an even one becomes the next odd one."""
    if not text.isdigit() or int(text) < 3:
        raise ArgumentTypeError(f"expected a whole number of pixels, at least 3, got {text}")
    return int(text) | 1


def size(text: str) -> tuple[int, int]:
    """Rows and columns of a photo."""
    rows, _, columns = text.partition("x")
    if not (rows.isdigit() and columns.isdigit() and min(int(rows), int(columns)) >= 64):
        raise ArgumentTypeError(f"expected ROWSxCOLUMNS of at least 64 each, got {text}")
    return int(rows), int(columns)


def grid(text: str) -> tuple[int, int]:
    """Rows and columns of parts."""
    rows, _, columns = text.partition("x")
    if not (rows.isdigit() and columns.isdigit() and int(rows) and int(columns)):
        raise ArgumentTypeError(f"expected ROWSxCOLUMNS of parts, got {text}")
    return int(rows), int(columns)
