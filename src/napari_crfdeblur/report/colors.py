"""Colors that the color-blind can tell apart, and that print (Okabe & Ito 2008)."""

from dataclasses import dataclass

GROUPS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9")
OTHERS = "#333333"
REJECTED = "#d62728"
CHANNELS = ("#d55e00", "#009e73", "#0072b2")
ONE = "#0072b2"
REFERENCES = ("#555555", "#aaaaaa", "#cc79a7", "#e69f00")
COVERED = "#e4ecf3"
INK, PALE = "#222222", "#6b6b6b"


@dataclass(frozen=True, slots=True)
class Palette:
    """Colors of curves and profiles on one kind of ground.

    Parameters
    ----------
    ink, pale : str
        Of letters.
    one : str
        Of the only curve, or the one of all channels.
    channels : tuple of str
        Of the curves of red, green and blue.
    references : tuple of str
        Of the curves to compare with.
    covered : str
        Of the range of intensity that the edges cover.
    shades : (float, float)
        Part of the color map viridis that can be seen well, for profiles from dark to bright.
    """

    ink: str
    pale: str
    one: str
    channels: tuple[str, ...]
    references: tuple[str, ...]
    covered: str
    shades: tuple[float, float]


# The yellow end of the color map is too faint on white, the blue one on black.
PAPER = Palette(INK, PALE, ONE, CHANNELS, REFERENCES, COVERED, (0.0, 0.88))
DARK = Palette(
    ink="#f0f1f2",
    pale="#b4b8bd",
    one="#56b4e9",
    channels=("#ff7f3f", "#1fc79a", "#56b4e9"),
    references=("#c8c8c8", "#7d7d7d", "#cc79a7", "#e69f00"),
    covered="#1d2c3a",
    shades=(0.28, 1.0),
)
