"""A report as one self-contained page of HTML, for the screen and for one sheet of paper."""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from .._version import __version__
from .content import Report, figure_table, sentences
from .panels import AXES, Panel, edges_panel, panel_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PLOT, PHOTO = 2.4, 4.0  # width or height of a panel, inches: its letters suit this size
DPI = 200
BORDER = 0.1  # inches around the axes, for half a letter of a label

STYLE = """
html { font: 15px/1.45 system-ui, sans-serif; color: #222; background: #fff; }
body { max-width: 60rem; margin: 1.5rem auto; padding: 0 1.5rem; }
h1 { font-size: 1.5rem; margin: 0; overflow-wrap: anywhere; }
header p { color: #6b6b6b; margin: 0 0 1rem; }
.row { display: flex; gap: 1.2rem; align-items: flex-start; margin: 0 0 1.2rem; }
.row > * { min-width: 0; margin: 0; }
.row > figure { flex: var(--share) 1 0; max-width: calc(var(--share) * 24rem); }
.row > .wide { flex-grow: 2; }
.row > div { flex: 1 1 12rem; }
figcaption, .row > div > p { font-weight: 600; margin: 0 0 .25rem; }
figcaption { white-space: nowrap; }
img { display: block; width: 100%; height: auto; }
ul { list-style: none; margin: 0; padding: 0; font-size: .9rem; }
li { display: flex; gap: .6rem; margin: .2rem 0; }
li i { flex: none; width: 1.6rem; height: 0; margin-top: .62em; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .2rem 1rem; margin: 0 0 1.2rem; }
dt { font-weight: 600; }
dd { margin: 0; }
table { border-collapse: collapse; font-size: .9rem; flex: 1; }
th { text-align: left; font-weight: 400; color: #6b6b6b; white-space: nowrap; }
th, td { padding: .15rem 1rem .15rem 0; border-bottom: 1px solid #eee; vertical-align: top; }
@page { size: A4; margin: 10mm; }
@media print {
  html { font-size: 8.5pt; }
  body { margin: 0; padding: 0; max-width: none; }
  .row { gap: 5mm; margin-bottom: 3mm; }
  .row > figure { max-width: calc(var(--share) * 38mm); }
  .row > .wide { max-width: calc(var(--share) * 45mm); }
  dl { margin-bottom: 3mm; }
}
"""


def html(report: Report) -> str:
    """The whole page as text, its pictures within it.

    Parameters
    ----------
    report : Report
        What is shown.
    """
    title = escape(report.title)
    edges = edges_panel(report)
    body = [_edges(edges)] if edges else []
    body += [_row(panels) for panels in panel_rows(report)]
    body += [_sentences(sentences(report)), _tables(figure_table(report))]
    parts = "\n".join(body)
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{STYLE}</style>
</head>
<body>
<header>
<h1>{title}</h1>
<p>napari-crfdeblur {__version__}</p>
</header>
<main>
{parts}
</main>
</body>
</html>
"""


def _edges(panel: Panel) -> str:
    """The edges on the photo beside their legend."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import to_hex, to_rgba_array

    figure, ax = _drawn(panel)
    entries = []
    for lines in (c for c in ax.collections if isinstance(c, LineCollection)):
        shade = to_hex(to_rgba_array(lines.get_edgecolor())[0].tolist())
        style = f"{1.8 * np.max(lines.get_linewidth()):.1f}px solid {shade}"
        label = escape(str(lines.get_label()))
        entries.append(f'<li><i style="border-top: {style}"></i><span>{label}</span></li>')
    return "\n".join(
        [
            f'<div class="row">\n{_picture(panel, figure, "wide")}',
            "<div>\n<p>by their angle to the horizontal</p>",
            "<ul>",
            *entries,
            "</ul>\n</div>\n</div>",
        ]
    )


def _row(panels: Sequence[Panel]) -> str:
    figures = [_picture(panel, _drawn(panel)[0], "panel") for panel in panels]
    return "\n".join(['<div class="row">', *figures, "</div>"])


def _sentences(said: Mapping[str, str]) -> str:
    items = [f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in said.items()]
    return "\n".join(["<dl>", *items, "</dl>"]) if items else ""


def _tables(figures: Mapping[str, str]) -> str:
    """Names and values in two tables side by side, read down."""
    rows = [
        f'<tr><th scope="row">{escape(k)}</th><td>{escape(v)}</td></tr>' for k, v in figures.items()
    ]
    half = -(-len(rows) // 2)
    parts = [rows[:half], rows[half:]]
    tables = ["\n".join(["<table>", "<tbody>", *p, "</tbody>", "</table>"]) for p in parts if p]
    return "\n".join(['<div class="row">', *tables, "</div>"]) if tables else ""


def _picture(panel: Panel, figure: "Figure", name: str) -> str:
    """A figure with its caption, that takes its share of the row by its shape."""
    kind, mime = ("svg", "svg+xml") if panel.margins == AXES else ("png", "png")
    stream = BytesIO()
    figure.savefig(stream, format=kind, dpi=DPI)
    data = b64encode(stream.getvalue()).decode("ascii")
    caption = escape(panel.caption)
    return f"""<figure class="{name}" style="--share: {panel.aspect:.4g}">
<figcaption>{caption}</figcaption>
<img alt="{caption}" src="data:image/{mime};base64,{data}">
</figure>"""


def _drawn(panel: Panel) -> tuple["Figure", "Axes"]:
    """A figure of one panel, at most so wide and high, with room for its labels."""
    from matplotlib.figure import Figure

    longest = PLOT if any(panel.margins) else PHOTO
    height = min(longest / panel.aspect, longest)
    left, below = panel.margins
    border = BORDER if any(panel.margins) else 0.01
    width = height * panel.aspect
    full = width + left + 2 * border, height + below + 2 * border
    figure = Figure(figsize=full, facecolor="white")
    box = (left + border) / full[0], (below + border) / full[1], width / full[0], height / full[1]
    ax = figure.add_axes(box)
    panel.draw(ax)
    return figure, ax
