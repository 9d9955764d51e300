"""Edges from and to files: lines and rectangles that a user drew, or found edges."""

import csv
import json
from collections.abc import Sequence
from io import StringIO
from math import degrees
from pathlib import Path
from typing import Any

from .. import arguments
from ..edges import Edge, Line, Rectangle
from ..errors import DAMAGED, CrfDeblurError
from ..texts import brief
from .files import check_output, write_text
from .inputs import read_bytes
from .json_files import number_list, parse_json
from .limits import LIMITS, Limits

FORMAT, VERSION = "crfdeblur-edges", 1
SUFFIXES = (".json", ".csv")  # that are written; only JSON is read
FARTHEST = 1e9  # pixels; no side of a photo is as long
COLUMNS = (
    *("number", "start_row", "start_column", "end_row", "end_column", "angle"),
    *("polarity", "width", "contrast", "status", "message"),
)


def write_edges(path: Path | str, edges: Sequence[Edge]) -> None:
    """Write edges with what is known of them, whole or not at all.

    Parameters
    ----------
    path : Path
        File that ends in ``.json``, which :func:`read_edges` reads, or in ``.csv``, for a
        spreadsheet: a row for each edge.
    edges : sequence of Edge
        Good ones and rejected ones.
    """
    path = arguments.path(path)
    arguments.instances(edges, Edge, "edges")
    check_output(path, SUFFIXES)
    if path.suffix.lower() == ".csv":
        write_text(path, _table(edges))
    else:
        write_text(path, json.dumps(edges_content(edges), indent=1) + "\n")


def edges_content(edges: Sequence[Edge]) -> dict[str, Any]:
    """What a JSON file of edges holds, as ``json`` takes it."""
    return {"format": FORMAT, "version": VERSION, "edges": [_entry(e) for e in edges]}


def read_edges(path: Path | str, *, limits: Limits = LIMITS) -> tuple[Line | Rectangle, ...]:
    """Read where edges are: each has ``start`` and ``end``, or the 4 ``corners`` of a rectangle.

    Only JSON is read. Points are [row, column] in pixels. Found edges that were rejected are
    passed over.

    Parameters
    ----------
    path : Path
    limits : Limits, optional
        For the size of the file.

    Raises
    ------
    CrfDeblurError
        Missing, or not a file of edges.
    """
    path = arguments.path(path)
    text = read_bytes(path, arguments.instance(limits, Limits, "Limits").json)
    try:
        content = parse_json(text, limits=limits)
        if content["format"] != FORMAT:
            raise ValueError(f'"format" is not "{FORMAT}"')
        entries = content["edges"]
        if not isinstance(entries, list) or not all(isinstance(each, dict) for each in entries):
            raise ValueError('"edges" is no list of objects')
        lines = tuple(_line(e) for e in entries if e.get("status", "good") == "good")
    except DAMAGED as error:
        raise CrfDeblurError(
            f'{path}: not a file of edges ({brief(error)}); expected {{"format": "{FORMAT}", '
            '"edges": [{"start": [row, column], "end": [row, column]}, ...]}'
        ) from error
    if not lines:
        raise CrfDeblurError(f"{path}: no edges in it; leave out --edges to find them")
    return lines


def _entry(edge: Edge) -> dict[str, Any]:
    return {
        "start": list(edge.start),
        "end": list(edge.end),
        "orientation": edge.orientation,
        "polarity": edge.polarity,
        "width": edge.width,
        "contrast": edge.contrast,
        "status": edge.status.name.lower(),
        "message": edge.status.value,
    }


def _table(edges: Sequence[Edge]) -> str:
    """A row of :data:`COLUMNS` for each edge: pixels, and the angle of its normal in degrees."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for number, edge in enumerate(edges):
        known = (edge.polarity, edge.width, edge.contrast)
        status = (edge.status.name.lower(), edge.status.value)
        angle = degrees(edge.orientation)
        writer.writerow((number, *edge.start, *edge.end, angle, *known, *status))
    return text.getvalue()


def _line(entry: dict[str, Any]) -> Line | Rectangle:
    if "corners" in entry:
        first, second, third, fourth = (_point(p) for p in entry["corners"])
        return Rectangle((first, second, third, fourth))
    return Line(_point(entry["start"]), _point(entry["end"]))


def _point(values: Any) -> tuple[float, float]:
    row, column = (float(each) for each in number_list(values))
    if not max(abs(row), abs(column)) <= FARTHEST:  # in this way it is false for NaN
        raise ValueError(f"no photo reaches to [{row:g}, {column:g}]")
    return row, column
