"""Between napari's layers and the core's arrays: pixels, places, edges; nothing else does this."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, TypeAlias

import numpy as np
from napari.components import ViewerModel
from napari.layers import Image as ImageLayer
from napari.layers import Layer, Shapes
from napari.utils.transforms import Affine

from .._typing import FloatArray, Image
from ..edges import Edge, Line, Rectangle
from ..errors import CrfDeblurError
from ..photo import from_unit
from ..report.colors import GROUPS, OTHERS, REJECTED

Region: TypeAlias = tuple[slice, ...]
"""Part of a layer's data: one slice with start and stop for each axis, color left out."""

Pairs: TypeAlias = tuple[tuple[int, int], ...]
"""A region as numbers that can be stored: start and stop of each axis."""

Span: TypeAlias = slice | tuple[int, int]
"""One axis of a region, in either form."""

SPATIAL = ("scale", "translate", "rotate", "shear", "affine", "units", "axis_labels")
MANY = "#9a9a9a"  # of further groups: seen on bright and on dark photos
KINDS = (np.uint8, np.uint16, np.float16, np.float32, np.float64)
LINE_WIDTH = 0.004  # of the photo's longer side, for edges that can be seen and clicked


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """The pixels of a photo layer as they were when a job began; safe in any thread.

    Parameters
    ----------
    data : array_like, shape (..., M, N) or (..., M, N, C)
        Of a numpy array, a dask array or the finest level of a pyramid.
    rgb : bool
        Whether the last axis holds colors.
    white : float or None
        Value that stands for intensity 1; by default the full scale of the kind of number.
    name : str
        Of the layer, for messages.
    """

    data: Any
    rgb: bool
    white: float | None
    name: str

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape without the color axis."""
        return tuple(self.data.shape[: self.data.ndim - self.rgb])

    @property
    def dtype(self) -> np.dtype[Any]:
        """Kind of number of the layer, and of what is given back."""
        dtype: np.dtype[Any] = np.dtype(self.data.dtype)
        return dtype

    @property
    def whole(self) -> Region:
        """All of it."""
        return tuple(slice(0, side) for side in self.shape)

    def photo(self, region: Region) -> Image:
        """One plane, or a part of it, as a photo: (M, N), (M, N, 3) or (M, N, 4)."""
        pixels = np.asarray(self.data[region])
        if pixels.dtype != self.dtype:
            raise CrfDeblurError(
                f"“{self.name}” says that it holds {self.dtype}, but this slice is "
                f"{pixels.dtype}; convert all slices to one kind of number"
            )
        pixels = pixels.reshape(pixels.shape[len(self.shape) - 2 :])
        return self.in_unit(pixels)

    def in_unit(self, pixels: Image) -> Image:
        """Pixels of the layer with its white level at 1; without one, as they are."""
        if self.white is None:
            return pixels
        return np.clip(pixels / np.float32(self.white), 0, 1).astype(np.float32, copy=False)

    def recorded(self, photo: Image) -> Image:
        """A photo in the layer's own numbers: the way back of :meth:`photo`."""
        if self.white is None:
            return photo.astype(self.dtype, copy=False)
        values = from_unit(photo, np.float32) * np.float32(self.white)
        if self.dtype.kind in "iu":
            values = np.rint(values)
        return values.astype(self.dtype)


def source_of(layer: ImageLayer, white: float | None = None) -> Source:
    """What a job needs of a photo layer; refuses what is no photo in a sentence.

    Raises
    ------
    CrfDeblurError
        No layer, not an image, fewer than two axes, empty, or numbers of another kind.
    """
    layer = unwrapped(layer)
    if layer is None:
        raise CrfDeblurError("there is no photo yet: open one, or choose an image layer")
    if not isinstance(layer, ImageLayer):
        raise CrfDeblurError(
            f"“{layer.name}” is a {type(layer).__name__} layer: choose an image layer instead"
        )
    data = layer.data[0] if layer.multiscale else layer.data
    shape = tuple(data.shape[: data.ndim - layer.rgb])
    if len(shape) < 2 or 0 in data.shape:
        raise CrfDeblurError(
            f"“{layer.name}” has shape {tuple(data.shape)}: choose a picture with rows and columns"
        )
    if white is not None and not (np.isfinite(white) and white > 0):
        raise ValueError(f"expected a positive white level, got {white}")
    if white is None and data.dtype not in KINDS:
        raise CrfDeblurError(
            f"“{layer.name}” holds numbers of kind {data.dtype}: set the white level, the value "
            "of the brightest pixel that the camera can record"
        )
    return Source(data, bool(layer.rgb), white, layer.name)


def unwrapped(thing: Any) -> Any:
    """The viewer or layer itself, where napari hands a plugin a proxy of it."""
    return getattr(thing, "__wrapped__", thing)


def region_of(source: Source, spans: Sequence[Span]) -> Region:
    """A region given by start and stop of each axis.

    Raises
    ------
    ValueError
        Not one span for each axis, or empty, or outside the data.
    """
    pairs_ = [(s.start, s.stop) if isinstance(s, slice) else tuple(s) for s in spans]
    if len(pairs_) != len(source.shape):
        raise ValueError(f"expected {len(source.shape)} spans, got {len(pairs_)}")
    for (start, stop), side in zip(pairs_, source.shape, strict=True):
        if not 0 <= start < stop <= side:
            raise ValueError(f"expected a span within 0 and {side}, got {start} to {stop}")
    return tuple(slice(int(start), int(stop)) for start, stop in pairs_)


def plane_at(source: Source, index: Sequence[int]) -> Region:
    """The plane of a stack at an index over all axes but rows and columns."""
    stack = [(int(i), int(i) + 1) for i in index]
    return region_of(source, [*stack, *pairs(source.whole[-2:])])


def pairs(region: Region) -> Pairs:
    """A region as numbers that can be stored."""
    return tuple((int(axis.start), int(axis.stop)) for axis in region)


def stack_index(plane: Region) -> tuple[int, ...]:
    """Index of a plane over all axes but rows and columns; empty for a single picture."""
    return tuple(int(axis.start) for axis in plane[:-2])


def planes_of(region: Region) -> Iterator[Region]:
    """The region plane by plane: slices of length 1 on all axes but rows and columns."""
    *stack, rows, columns = region
    for index in product(*(range(axis.start, axis.stop) for axis in stack)):
        yield (*(slice(i, i + 1) for i in index), rows, columns)


def shown_plane(viewer: ViewerModel, layer: ImageLayer) -> Region:
    """The plane of a stack that the viewer shows, all rows and columns."""
    source = source_of(layer, white=1.0)
    point = np.rint(layer.world_to_data(viewer.dims.point)[-len(source.shape) :])
    index = np.clip(point, 0, np.array(source.shape) - 1).astype(int)[:-2]
    return (*(slice(int(i), int(i) + 1) for i in index), *source.whole[-2:])


def visible_part(viewer: ViewerModel, layer: ImageLayer, largest: int) -> Region:
    """What the canvas shows of the plane, at most `largest` rows and columns about its middle."""
    *stack, rows, columns = shown_plane(viewer, layer)
    # Corners are given for the level that is drawn; what counts is the finest.
    ratio = layer.downsample_factors[layer.data_level] if layer.multiscale else np.ones(layer.ndim)
    corners = np.asarray(layer.corner_pixels * ratio)[:, -2:].astype(int)
    if np.any(corners[1] <= corners[0]):  # nothing has been drawn yet
        corners = np.array([[0, 0], [rows.stop, columns.stop]])
    sides = []
    for low, high, whole in zip(*corners, (rows, columns), strict=True):
        low, high = max(int(low), 0), min(int(high) + 1, whole.stop)
        middle = (low + high) // 2
        low = max(low, middle - largest // 2)
        sides.append(slice(low, min(high, low + largest)))
    return (*stack, *sides)


def placed(layer: ImageLayer, region: Region | None = None) -> dict[str, Any]:
    """The seven spatial properties of a layer, for its data or a region of it."""
    place = {name: getattr(layer, name) for name in SPATIAL}
    if region is not None:
        start = np.array([axis.start for axis in region], dtype=float)
        linear = Affine(scale=layer.scale, rotate=layer.rotate, shear=layer.shear).linear_matrix
        place["translate"] = layer.translate + linear @ start
    return place


def like(layer: ImageLayer, name: str, data: Image, region: Region, **options: Any) -> ImageLayer:
    """A layer of pixels computed from a region of another one, placed and colored like it."""
    options = {
        "contrast_limits": layer.contrast_limits,
        "gamma": layer.gamma,
        "interpolation2d": layer.interpolation2d,
        **({} if layer.rgb else {"colormap": layer.colormap.name}),
        **placed(layer, region),
        **options,
    }
    return ImageLayer(data, name=name, rgb=layer.rgb, multiscale=False, **options)


def beside(layer: ImageLayer, name: str, kernel: FloatArray, metadata: Any) -> ImageLayer:
    """A PSF as a layer to the left of the photo, in pixels of the same size.

    Beside a stack it is a single picture, too: with the slices' axis it would be seen on one.
    One of three dimensions begins at the first slice.
    """
    shift = slice(-(kernel.shape[-1] + 4), -4)
    place = placed(layer, (*(slice(0, 1) for _ in range(layer.ndim - 1)), shift))
    data = kernel.astype(np.float32)
    return ImageLayer(
        data,
        name=name,
        rgb=False,
        colormap="inferno",
        contrast_limits=(0.0, float(data.max())),
        metadata=metadata,
        **_of_last(place, kernel.ndim),
    )


def _of_last(place: dict[str, Any], axes: int) -> dict[str, Any]:
    """Spatial properties for the last axes alone; the same where there is nothing else."""
    if len(place["scale"]) == axes:
        return place
    last = np.s_[-axes:, -axes:]
    return {
        **{name: place[name][-axes:] for name in ("scale", "translate", "units", "axis_labels")},
        "rotate": place["rotate"][last],
        "shear": place["shear"][-(axes * (axes - 1) // 2) :],  # upper triangle, row by row
        "affine": Affine(
            linear_matrix=place["affine"].linear_matrix[last],
            translate=place["affine"].translate[-axes:],
        ),
    }


def kernel_of(layer: ImageLayer, photo: ImageLayer | None = None) -> FloatArray:
    """The PSF in an image layer, shape (H, W), or (D, H, W) for a photo that is a stack.

    Raises
    ------
    CrfDeblurError
        In color, or more axes than a PSF of this photo can have.
    """
    source = source_of(layer, white=1.0)
    if source.rgb:
        raise CrfDeblurError(f"“{layer.name}” has colors: a PSF is a grayscale picture")
    axes = 3 if photo is not None and photo.ndim > 2 else 2
    *others, depth = (1, *source.shape[:-2])
    if max((*others, 1)) > 1 or (axes == 2 and depth > 1):
        wanted = "a single picture" if axes == 2 else "a picture, or one stack of them"
        raise CrfDeblurError(f"“{layer.name}” is a stack: a PSF is {wanted}")
    shape = source.shape[-2:] if depth == 1 else (depth, *source.shape[-2:])
    return np.asarray(source.data, dtype=np.float64).reshape(shape)


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


def points_in(layer: Shapes, vertices: FloatArray, photo: ImageLayer) -> list[tuple[float, float]]:
    """Vertices of a Shapes layer as (row, column) of the photo, whatever their coordinates."""
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


def file_of(layer: Layer) -> str | None:
    """Where a layer was read from, if it was."""
    path = layer.source.path
    return None if path is None else str(path)
