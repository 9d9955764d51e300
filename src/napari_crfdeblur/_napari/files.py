"""Edges and camera responses as layers, from and to the files of the library."""

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._typing import Image
from ..edges import Edge, EdgeStatus, Line, Point, Rectangle
from ..errors import CrfDeblurError
from ..estimate import GivenResponse, ResponseEstimate, ResponseStatus
from ..io import check_output, read_edges, read_responses, write_edges, write_text
from ..io.json_files import read_json
from ..io.responses import SUFFIXES, responses_from
from ..report import draw_response
from ..report.colors import GROUPS
from ..response import ResponseCurve
from .pixels import KEY

if TYPE_CHECKING:
    from napari.types import LayerDataTuple

OWN_FORMAT = re.compile(rb'"format"\s*:\s*"crfdeblur-(edges|response)"')
LOOKED_AT = 1 << 20  # bytes in which the format must be named; our own files begin with it
MEASURED = ("polarity", "width", "contrast")  # features of a layer of edges
STATUSES = {status.value for status in EdgeStatus}
INCHES, DOTS = (4.8, 4.0), 200  # of the picture of a response


def get_reader(
    path: str | Sequence[str],
) -> "Callable[[str | Sequence[str]], list[LayerDataTuple]] | None":
    """The reader for JSON files of edges or of a response; None for all others."""
    return read if all(_format(own) for own in _listed(path)) else None


def read(path: str | Sequence[str]) -> "list[LayerDataTuple]":
    """Read edges as lines, and a response as a picture of its curve.

    Raises
    ------
    CrfDeblurError
        Not a whole file of its format; the message says what is wrong.
    """
    readers = {"edges": _edge_layer, "response": _response_layer}
    return [readers[_format(own)](Path(own)) for own in _listed(path)]


def write_edge_layer(path: str, data: Any, attributes: dict[str, Any]) -> list[str]:
    """Write the lines of a Shapes layer as edges, in pixels of that layer.

    Raises
    ------
    CrfDeblurError
        The layer holds other shapes than lines, or the file cannot be written.
    """
    kinds, known = attributes["shape_type"], attributes["features"]
    kinds = [kinds] * len(data) if isinstance(kinds, str) else kinds
    edges = []
    for number, (vertices, kind) in enumerate(zip(data, kinds, strict=True)):
        if kind not in ("line", "path") or len(vertices) != 2:
            raise CrfDeblurError(
                f"edges are saved as lines, but shape {number + 1} of “{attributes['name']}” is a "
                f"{kind} of {len(vertices)} points: find or refine the edges first, or remove it"
            )
        start, end = ((float(row), float(column)) for row, column in np.asarray(vertices)[:, -2:])
        if start == end:
            raise CrfDeblurError(
                f"shape {number + 1} of “{attributes['name']}” is a single point: remove it"
            )
        edges.append(Edge(start, end, **_measured(known, number)))
    write_edges(Path(path), edges)
    return [path]


def write_response_layer(path: str, data: Image, attributes: dict[str, Any]) -> list[str]:  # noqa: ARG001 - napari hands over the pixels, too
    """Write the response with which an image was made, or which it shows.

    Raises
    ------
    CrfDeblurError
        Nothing in the layer says what the response is, or the file cannot be written.
    """
    content = attributes["metadata"].get(KEY, {}).get("response")
    if content is None:
        raise CrfDeblurError(
            f"“{attributes['name']}” holds no camera response: save a layer that was made with "
            "one, or save the picture itself as TIFF or PNG"
        )
    responses_from(content, f"“{attributes['name']}”")  # metadata can be edited
    check_output(Path(path), SUFFIXES)
    write_text(Path(path), json.dumps(content, indent=1) + "\n")
    return [path]


def _listed(path: str | Sequence[str]) -> list[str]:
    return [path] if isinstance(path, str) else list(path)


def _format(path: str) -> str:
    """``edges`` or ``response`` for a file of ours, else nothing."""
    file = Path(path)
    if not file.is_file():
        return ""
    with file.open("rb") as opened:
        named = OWN_FORMAT.search(opened.read(LOOKED_AT))
    return named.group(1).decode() if named else ""


def _edge_layer(path: Path) -> "LayerDataTuple":
    """Edges as lines and rectangles; those that were rejected are passed over."""
    shapes = read_edges(path)
    entries = read_json(path)["edges"]
    entries = [entry for entry in entries if entry.get("status", "good") == "good"]
    options = {
        "name": path.stem,
        "shape_type": ["line" if isinstance(shape, Line) else "rectangle" for shape in shapes],
        "features": {name: [entry.get(name, 0) for entry in entries] for name in MEASURED},
        "edge_color": GROUPS[0],
        "edge_width": 2,
        "face_color": "transparent",
    }
    return [np.array(_points(shape)) for shape in shapes], options, "shapes"


def _points(shape: Line | Rectangle) -> tuple[Point, ...]:
    return (shape.start, shape.end) if isinstance(shape, Line) else shape.corners


def _measured(features: Any, number: int) -> dict[str, Any]:
    """What the features of a layer tell of an edge; nothing for lines that were just drawn."""
    known = {name: float(features[name].iloc[number]) for name in MEASURED if name in features}
    if "polarity" in known:
        known["polarity"] = int(known["polarity"])
    said = features["status"].iloc[number] if "status" in features else None
    return known | ({"status": EdgeStatus(said)} if said in STATUSES else {})


def _response_layer(path: Path) -> "LayerDataTuple":
    """A picture of the curves; the file itself goes along as metadata, to be used or saved."""
    curves = read_responses(path)
    content = read_json(path)
    channels = zip(curves, content["channels"], strict=True)
    picture = _picture([_estimate(curve, channel) for curve, channel in channels])
    options = {
        "name": path.stem,
        "rgb": True,
        "contrast_limits": (0, 255),
        "metadata": {KEY: {"response": content}},
    }
    return picture, options, "image"


def _estimate(curve: ResponseCurve, channel: dict[str, Any]) -> ResponseEstimate:
    """The estimate as it was written, or a given curve if the file was made by hand."""
    given = GivenResponse(curve).estimate()
    try:
        intensity, *band = (np.asarray(channel[n], float) for n in ("intensity", "lower", "upper"))
        lower, upper = (side.reshape(intensity.shape) for side in band)
        covered = float(channel["covered"][0]), float(channel["covered"][1])
        status = ResponseStatus[channel["status"].upper()]
    except (KeyError, IndexError, TypeError, ValueError, AttributeError):
        return given
    return ResponseEstimate(curve, intensity, lower, upper, covered, status)


def _picture(estimates: Sequence[ResponseEstimate]) -> Image:
    """The plot of a response as pixels, shape (M, N, 4), uint8."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=INCHES, dpi=DOTS, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    draw_response(figure.add_subplot(), estimates)
    canvas.draw()
    return np.array(canvas.buffer_rgba())
