"""Shapes layers: edges in their colors, and what is drawn, in pixels of the photo."""

from collections.abc import Sequence

import numpy as np
from napari.layers import Image as ImageLayer
from napari.layers import Points, Shapes

from .._typing import FloatArray
from ..deconvolution.tiles import Region
from ..edges import Edge, Line, Rectangle
from ..errors import CrfDeblurError
from ..report.colors import GROUPS, OTHERS, REJECTED
from .pixels import source_of
from .placing import placed

MANY = "#9a9a9a"  # of further groups: seen on bright and on dark photos
LINE_WIDTH = 0.004  # of the photo's longer side, for edges that can be seen and clicked


def drawing_layer(photo: ImageLayer, name: str, color: str = OTHERS) -> Shapes:
    """An empty layer to draw on, in the photo's own coordinates."""
    return Shapes(
        ndim=photo.ndim,
        name=name,
        face_color="transparent",
        edge_color=color,
        edge_width=line_width(photo),
        **placed(photo),
    )


def region_drawn_on(layer: Shapes, photo: ImageLayer) -> Region:
    """The part of one plane of the photo that the last shape of a layer encloses.

    Raises
    ------
    CrfDeblurError
        Nothing is drawn, or not on the photo.
    """
    if not len(layer.data):
        raise CrfDeblurError("no region is drawn yet: drag a rectangle on the photo")
    number = len(layer.data) - 1
    source = source_of(photo, white=1.0)
    corners = np.array(points_in(layer, np.asarray(layer.data[number]), photo))
    # A pixel reaches half a pixel to either side of its number.
    first = np.maximum(np.floor(corners.min(axis=0) + 0.5).astype(int), 0)
    last = np.minimum(np.floor(corners.max(axis=0) + 0.5).astype(int) + 1, source.shape[-2:])
    index = plane_drawn_on(layer, number, photo) or (0,) * (len(source.shape) - 2)
    inside = all(0 <= i < side for i, side in zip(index, source.shape, strict=False))
    if not inside or np.any(first >= last):
        raise CrfDeblurError("the region lies outside the photo: draw it on the photo")
    sides = (slice(int(a), int(b)) for a, b in zip(first, last, strict=True))
    return (*(slice(i, i + 1) for i in index), *sides)


def edge_layer(photo: ImageLayer) -> Shapes:
    """An empty layer for the edges of a photo, in the photo's own coordinates."""
    return drawing_layer(photo, f"{photo.name} [edges]")


def line_width(photo: ImageLayer) -> float:
    """Width in pixels at which edges can be seen in the whole photo."""
    return max(1.0, LINE_WIDTH * max(source_of(photo, white=1.0).shape[-2:]))


def paint_edges(
    layer: Shapes,
    photo: ImageLayer,
    plane: Region,
    edges: Sequence[Edge],
    groups: Sequence[int],
    drawn: Sequence[tuple[FloatArray, str]] = (),
) -> list[FloatArray]:
    """Show edges as lines, colored by group (-1: rejected); returns their vertices as written.

    `drawn` are shapes that are no edges yet, by vertices and kind; they come after the edges.
    """
    lines = [(line, "line") for line in _vertices(layer, photo, plane, edges)]
    shapes = [*lines, *drawn]
    colors = [group_color(group) for group in groups] + [OTHERS] * len(drawn)
    waiting = [None] * len(drawn)
    # The thumbnail would be drawn at each change, for as long as all the rest.
    with layer.block_thumbnail_update():
        layer.data = []
        if shapes:
            width = line_width(photo)
            layer.add(shapes, edge_color=colors, edge_width=width, face_color="transparent")
            layer.features = {
                "group": [*groups, *([-1] * len(drawn))],
                "status": [*(edge.status.value for edge in edges), *waiting],
            }
    layer.refresh(data_displayed=False, highlight=False, extent=False)
    return [np.array(vertices) for vertices in layer.data[: len(lines)]]


def group_color(group: int) -> str:
    """Color of an orientation group in every view; -1 stands for rejected edges."""
    if group < 0:
        return REJECTED
    return GROUPS[group] if group < len(GROUPS) else MANY


def drawn_shape(layer: Shapes, number: int, photo: ImageLayer) -> Line | Rectangle:
    """A shape of any Shapes layer as a line or a rectangle in pixels of the photo.

    Raises
    ------
    CrfDeblurError
        Neither a line nor a rectangle.
    """
    kind = layer.shape_type[number]
    points = points_in(layer, np.asarray(layer.data[number]), photo)
    if kind == "rectangle":
        first, second, third, fourth = points
        return Rectangle((first, second, third, fourth))
    if kind in ("line", "path") and len(points) == 2 and points[0] != points[1]:
        return Line(points[0], points[1])
    raise CrfDeblurError(
        f"edges are drawn as lines or rectangles, not as {kind}s; remove shape {number + 1}"
    )


def points_in(
    layer: Points | Shapes, vertices: FloatArray, photo: ImageLayer
) -> list[tuple[float, float]]:
    """Vertices of a layer as (row, column) of the photo, whatever their coordinates."""
    points = []
    for vertex in vertices:
        world = layer.data_to_world(vertex)
        row, column = photo.world_to_data(world)[-2:]
        points.append((float(row), float(column)))
    return points


def plane_drawn_on(layer: Shapes, number: int, photo: ImageLayer) -> tuple[int, ...]:
    """Index of the plane of a stack on which a shape was drawn; empty for a single picture."""
    if layer.ndim < photo.ndim:
        return ()
    first = photo.world_to_data(layer.data_to_world(np.asarray(layer.data[number])[0]))
    return tuple(int(i) for i in np.rint(first[:-2]))


def _vertices(layer: Shapes, photo: ImageLayer, plane: Region, edges: Sequence[Edge]) -> FloatArray:
    """Ends of edges in coordinates of a layer, shape (n, 2, ndim)."""
    stack = [float(axis.start) for axis in plane[:-2]]
    ends = np.array([[*stack, *point] for edge in edges for point in (edge.start, edge.end)])
    if not len(ends):
        return np.empty((0, 2, layer.ndim))

    def there(point: FloatArray) -> FloatArray:
        return np.asarray(layer.world_to_data(photo.data_to_world(point)))[-layer.ndim :]

    # napari takes one point after the other; the map is affine, so that few tell all.
    origin = there(np.zeros(photo.ndim))
    columns = [there(axis) - origin for axis in np.eye(photo.ndim)]
    return (ends @ np.array(columns) + origin).reshape(len(edges), 2, layer.ndim)
