"""Edges on the canvas: what the user draws goes into the session, what it finds is shown."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from napari.layers import Image as ImageLayer
from napari.layers import Layer, Shapes

from ..edges import Edge, Line, Rectangle
from ..errors import REFUSALS, CrfDeblurError, in_words
from .pixels import source_of, unwrapped
from .regions import shown_plane, stack_index
from .session.edges import ONE_SLICE, EdgeVerbs, joined, setting_edges
from .session.state import EdgeSet
from .session.step import Level
from .session.workspace import Workspace
from .shapes import drawn_shape, edge_layer, paint_edges, plane_drawn_on
from .shown import Shown

DRAWN = ("added", "changed", "removed")  # events that come after the shapes have changed
DRAWING = {"line": "add_line", "rectangle": "add_rectangle"}  # napari's modes
CLICKED = "a click draws nothing: press at one end, move to the other, and release there"
IN_3D = "edges are drawn on a picture: leave the 3D view first"
CLOSED = "the photo of these edges was closed: open it again, and draw on it"
OFF_STACK = "“{}” has no slice there: move to one that it has, and draw on that"
DELETED = "the edges of “{}” went with their layer; undo brings them back"

Index = tuple[int, ...]


class EdgeDrawing:
    """Keeps the edges of the session and the Shapes layer of the photo alike.

    What is drawn while a step is under way, or found while the mouse draws, is added to the
    other: nothing is lost, whichever comes first.

    Parameters
    ----------
    session : Workspace
        Whose edges are drawn.
    """

    def __init__(self, session: Workspace) -> None:
        self._session = session
        self._all: WeakKeyDictionary[Layer, Shown] = WeakKeyDictionary()
        self._painting = self._dragging = self._moved = False
        session.photo_changed.connect(self.paint)
        session.edges_changed.connect(self.paint)
        session.selection_changed.connect(self._show_selection)
        # Closures, so that they live as long as the viewer.
        layers = session.viewer.layers
        layers.events.removed.connect(lambda event: self._removed(event.value))
        layers.selection.events.active.connect(lambda: self._released())

    @property
    def layer(self) -> Shapes | None:
        """The edge layer of the photo, if it has one in the viewer."""
        shown = self._shown
        return shown.layer if shown else None

    @property
    def chosen(self) -> tuple[int, ...]:
        """Numbers of all edges that are selected on the canvas, or the one of the session."""
        selected, layer = self._session.selected, self.layer
        if layer is None or selected is None:
            return () if selected is None else (selected,)
        return tuple(sorted({selected, *self._selected(layer)}))

    def choose(self, numbers: Sequence[int]) -> None:
        """Select edges on the canvas, the last of them for the session."""
        layer = self.layer
        if layer is not None:
            with self._quiet():
                layer.selected_data = set(numbers)
            if layer.mode == "pan_zoom":
                layer.mode = "select"  # the only one that frames what is selected
        self._session.selected = numbers[-1] if numbers else None

    def owns(self, layer: Layer) -> bool:
        """Whether a layer shows the edges of some photo."""
        return any(shown.layer is unwrapped(layer) for shown in self._all.values())

    def begin(self, shape: str = "line") -> Shapes:
        """The edge layer of the photo, in front and ready for lines or rectangles.

        Raises
        ------
        CrfDeblurError
            There is no photo, or the viewer shows it in 3D.
        """
        if shape not in DRAWING:
            raise ValueError(f"expected line or rectangle, got {shape}")
        photo, _ = self._session.source()
        viewer = self._session.viewer
        if viewer.dims.ndisplay != 2:
            raise CrfDeblurError(IN_3D)
        shown = self._shown or self._made(photo)
        viewer.layers.selection.active = shown.layer
        shown.layer.visible = True
        shown.layer.mode = DRAWING[shape]
        return shown.layer

    def adopted(self, layer: Shapes) -> tuple[list[Line | Rectangle], Index | None]:
        """The shapes of any Shapes layer in pixels of the photo, and their plane of a stack.

        Raises
        ------
        CrfDeblurError
            No Shapes layer, no shapes, or neither lines nor rectangles.
        """
        photo, _ = self._session.source()
        if not isinstance(layer, Shapes):
            raise CrfDeblurError(
                f"“{layer.name}” is a {type(layer).__name__} layer: choose a Shapes layer with "
                "lines along edges"
            )
        numbers = range(len(layer.data))
        if not numbers:
            raise CrfDeblurError(f"“{layer.name}” is empty: draw lines along edges first")
        plane = _one_plane(photo, {plane_drawn_on(layer, number, photo) for number in numbers})
        return [drawn_shape(layer, n, photo) for n in numbers], plane or None

    def read(self) -> None:
        """Take over what was drawn, moved or deleted since the edges were last shown.

        Raises
        ------
        CrfDeblurError
            Neither lines nor rectangles, or on several slices of a stack.
        """
        session, shown, photo = self._session, self._shown, self._session.photo
        if shown is None or photo is None:
            return
        now = session.state.edges
        items: dict[Edge | Line | Rectangle, bytes] = {}  # without the same edge twice
        planes = {stack_index(now.plane)} if now and now.edges else set()
        for number, key, edge in shown.shapes():
            items.setdefault(edge or drawn_shape(shown.layer, number, photo), key)
            if edge is None:
                planes.add(plane_drawn_on(shown.layer, number, photo))
        plane = _one_plane(photo, planes)
        # Edges can have changed without being shown yet, while the mouse drew.
        wanted = tuple(items) if now is shown.edges else joined(shown.edges, now, tuple(items))
        if wanted != (now.edges if now else ()):
            step = setting_edges(session, wanted, plane=plane or None)
            keys = [items[item] for item in wanted if item in items]
            places = [place for place, item in enumerate(wanted) if item in items]
            session.start(shown.noting(step, keys, places))

    def paint(self) -> None:
        """Show the edges of the session, unless the mouse is just drawing one."""
        photo, edges, shown = self._session.photo, self._session.state.edges, self._shown
        if photo is None or self._dragging:
            return
        if shown is None and edges is not None:
            shown = self._made(photo)
        if shown is not None and (shown.edges is not edges or shown.refused):
            drawn = set(shown.made.values())
            self._write(shown, photo, edges)
            self._select_drawn(drawn, edges)

    def _write(self, shown: Shown, photo: ImageLayer, edges: EdgeSet | None) -> None:
        """Show edges; shapes that were drawn since and are still being refined stay."""
        found = edges.edges if edges else ()
        groups = edges.group_numbers if edges else ()
        plane = edges.plane if edges else shown_plane(self._session.viewer, photo)
        pending, layer = shown.pending(found), shown.layer
        kept = [(np.array(layer.data[n]), layer.shape_type[n]) for n, _, _ in pending]
        with self._quiet():
            written = paint_edges(layer, photo, plane, found, groups, kept)
        shown.shows(edges, written, pending)

    def _select_drawn(self, drawn: set[Edge], edges: EdgeSet | None) -> None:
        """Select the edge that was drawn or moved last, so that its profile is seen."""
        numbers = [n for n, edge in enumerate(edges.edges if edges else ()) if edge in drawn]
        if len(numbers) == 1:
            self._session.selected = numbers[0]
        else:
            self._show_selection(self._session.selected)

    @property
    def _shown(self) -> Shown | None:
        photo = self._session.photo
        shown = None if photo is None else self._all.get(photo)
        return shown if shown is not None and shown.layer in self._session.viewer.layers else None

    def _made(self, photo: ImageLayer) -> Shown:
        layer = edge_layer(photo)
        shown = self._all[photo] = Shown(layer)
        layer.events.data.connect(self._on_data)
        layer.events.mode.connect(lambda: self._follow(layer))
        layer.selected_data.events.items_changed.connect(lambda: self._on_selection(layer))
        layer.mouse_drag_callbacks.append(self._on_drag)
        self._follow(layer)
        self._session.viewer.add_layer(layer)
        return shown

    def _on_data(self, event: Any) -> None:
        if self._painting or event.action not in DRAWN:
            return
        layer = event.source
        photo = next((p for p, shown in self._all.items() if shown.layer is layer), None)
        if photo is None or photo not in self._session.viewer.layers:
            self._session.say(CLOSED, Level.ERROR)
            return
        try:
            self._session.photo = photo
            if self._dragging and not self._moved and layer.mode in DRAWING.values():
                raise CrfDeblurError(CLICKED)
            self.read()
        except REFUSALS as error:
            self._all[photo].refused = True
            self._session.say(in_words(error), Level.ERROR)
            self.paint()

    def _on_selection(self, layer: Shapes) -> None:
        if not self._painting and layer is self.layer:
            chosen = self._selected(layer)
            self._session.selected = chosen[-1] if chosen else None

    def _selected(self, layer: Shapes) -> list[int]:
        edges = self._session.state.edges
        count = len(edges.edges) if edges else 0
        return [number for number in layer.selected_data if number < count]

    def _show_selection(self, number: int | None) -> None:
        layer = self.layer
        if layer is None or self._dragging or number in layer.selected_data:
            return  # among several that are selected on the canvas: they stay so
        with self._quiet():
            layer.selected_data = set() if number is None else {number}

    def _on_drag(self, _: Shapes, event: Any) -> Iterator[None]:
        """Comes before napari's own tools, which draw while the mouse moves."""
        self._dragging, self._moved = True, False
        yield
        while event.type == "mouse_move":
            self._moved = True
            yield

    def _on_dragged(self, _: Shapes, event: Any) -> Iterator[None]:
        """Comes after napari's own tools, which tell what was drawn when the mouse is released."""
        yield
        while event.type == "mouse_move":
            yield
        self._released()

    def _follow(self, layer: Shapes) -> None:
        """Stay behind the tool of a new mode in the list of what follows the mouse."""
        if self._on_dragged in layer.mouse_drag_callbacks:
            layer.mouse_drag_callbacks.remove(self._on_dragged)
        layer.mouse_drag_callbacks.append(self._on_dragged)

    def _released(self) -> None:
        if self._dragging:
            self._dragging = False
            self.paint()

    def _removed(self, layer: Layer) -> None:
        """Without their layer a photo has no edges, until undo brings them back."""
        photo = next((p for p, shown in self._all.items() if shown.layer is layer), None)
        if photo is None:
            return
        self._dragging = False
        del self._all[photo]
        state = self._session.state_of(photo)
        if photo in self._session.viewer.layers and state.edges is not None:
            self._session.commit(photo, state.with_edges(None, by_hand=True))
            self._session.say(DELETED.format(photo.name))

    @contextmanager
    def _quiet(self) -> Iterator[None]:
        self._painting = True
        try:
            yield
        finally:
            self._painting = False


class DrawingVerbs(EdgeVerbs):
    """Verbs of a session with the layer on which edges are drawn."""

    drawing: EdgeDrawing

    def draw_edges(self, shape: str = "line") -> Shapes:
        """Make the layer on which edges are drawn, ready for a ``line`` or a ``rectangle``."""
        return self.drawing.begin(shape)

    def use_edges_of(self, layer: Shapes) -> EdgeSet:
        """Use the lines and rectangles of any Shapes layer; its own coordinates count."""
        items, plane = self.drawing.adopted(unwrapped(layer))
        return self.set_edges(items, plane=plane)


def _one_plane(photo: ImageLayer, planes: set[Index]) -> Index:
    """The plane of a stack that all shapes are drawn on; empty for a single picture."""
    planes = planes - {()}
    if len(planes) > 1:
        raise CrfDeblurError(ONE_SLICE)
    plane = next(iter(planes), ())
    sides = source_of(photo, white=1.0).shape[:-2]
    if any(not 0 <= i < side for i, side in zip(plane, sides, strict=False)):
        raise CrfDeblurError(OFF_STACK.format(photo.name))
    return plane
