"""A report as one picture: rows of panels on a page, laid out in inches from the top."""

from collections.abc import Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Any

from .._version import __version__
from .colors import INK, PALE
from .content import Report, figure_table, sentences
from .panels import Panel, edges_panel, panel_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, EDGE = 8.27, 0.5  # inches: an A4 page and its border
INNER = WIDTH - 2 * EDGE
DPI = 200
HEAD, CAPTION, GAP = 1.15, 0.24, 0.2
TALLEST = 2.7  # of a row
LEGEND = 2.6  # least width of the legend beside the edges
LINE = 0.155  # height of a line of small text


def page(report: Report) -> "Figure":
    """The whole page as a figure, A4 wide and as high as its content.

    Parameters
    ----------
    report : Report
        What is shown.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    edges, rows = edges_panel(report), panel_rows(report)
    lines = [fill(f"{k}: {v}", 128, subsequent_indent="    ") for k, v in sentences(report).items()]
    figures = list(figure_table(report).items())
    heights = [_height(row) for row in rows]
    picture = min(TALLEST, (INNER - LEGEND - GAP) / edges.aspect) if edges else 0.0
    text = LINE * (sum(line.count("\n") + 1 for line in lines) + -(-len(figures) // 2)) + 2 * GAP
    total = HEAD + sum(h + CAPTION + GAP for h in ([picture] if edges else []) + heights) + text
    figure = Figure(figsize=(WIDTH, total + EDGE), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    sheet = Sheet(figure)
    sheet.head(report.title)
    if edges:
        sheet.edges(edges, picture)
    for row, height in zip(rows, heights, strict=True):
        sheet.row(row, height)
    sheet.lines(lines)
    sheet.table(figures)
    return figure


class Sheet:
    """A page that is filled from its top; `y` is where the next thing starts, in inches."""

    def __init__(self, figure: "Figure") -> None:
        self.figure = figure
        self.y = EDGE

    def head(self, title: str) -> None:
        """The title, and what made the page."""
        self._text(EDGE, self.y, fill(title, 60, max_lines=1), size=15, weight="bold")
        self._text(EDGE, self.y + 0.3, f"napari-crfdeblur {__version__}", size=7.5, color=PALE)
        self.y = HEAD

    def edges(self, panel: Panel, height: float) -> None:
        """The edges on the photo, their legend beside it."""
        ax = self._panel(panel, EDGE, height)
        handles, labels = ax.get_legend_handles_labels()
        left = EDGE + height * panel.aspect + GAP
        letters = int((WIDTH - EDGE - left - 0.35) / 0.062)
        ax.legend(
            handles,
            [fill(label, letters) for label in labels],
            loc="upper left",
            bbox_to_anchor=(1 + GAP / (height * panel.aspect), 1),
            borderaxespad=0,
            frameon=False,
            fontsize=7.5,
            labelcolor=INK,
            title="by their angle to the horizontal",
            title_fontproperties={"size": 7.5},
            alignment="left",
        )
        self.y += height + CAPTION + GAP

    def row(self, panels: Sequence[Panel], height: float) -> None:
        """Panels side by side, spread over the width of the page."""
        inner = height - max(p.margins[1] for p in panels)
        left = EDGE
        for panel in panels:
            left += panel.margins[0]
            self._panel(panel, left, inner)
            left += inner * panel.aspect + GAP
        self.y += height + CAPTION + GAP

    def lines(self, lines: Sequence[str]) -> None:
        """Sentences below one another."""
        for line in lines:
            self._text(EDGE, self.y, line, size=8, linespacing=1.25)
            self.y += LINE * (line.count("\n") + 1)
        self.y += GAP if lines else 0

    def table(self, figures: Sequence[tuple[str, str]]) -> None:
        """Names and values in two columns, read down."""
        half = -(-len(figures) // 2)
        for number, (name, value) in enumerate(figures):
            left = EDGE + (INNER / 2 + GAP / 2) * (number // max(half, 1))
            top = self.y + LINE * (number % max(half, 1))
            self._text(left, top, name, size=7.5, color=PALE)
            self._text(left + 1.7, top, value, size=7.5)

    def _panel(self, panel: Panel, left: float, height: float) -> "Axes":
        self._text(left - panel.margins[0], self.y, panel.caption, size=8.5, weight="bold")
        width, total = self.figure.get_size_inches()
        bottom = total - self.y - CAPTION - height
        box = left / width, bottom / total, height * panel.aspect / width, height / total
        ax = self.figure.add_axes(box)
        panel.draw(ax)
        return ax

    def _text(self, left: float, top: float, text: str, color: str = INK, **style: Any) -> None:
        width, total = self.figure.get_size_inches()
        # A "$" in the name of a file is a dollar, not mathematics.
        style |= {"color": color, "va": "top", "parse_math": False}
        self.figure.text(left / width, 1 - top / total, text, **style)


def _height(panels: Sequence[Panel]) -> float:
    """Height at which panels fill the width, labels below them included."""
    below = max(p.margins[1] for p in panels)
    room = INNER - GAP * (len(panels) - 1) - sum(p.margins[0] for p in panels)
    return min(room / sum(p.aspect for p in panels) + below, TALLEST)
