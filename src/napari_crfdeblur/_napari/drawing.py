"""Edges on the canvas: what the user draws goes into the session, what it finds is shown."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from napari.layers import Layer, Shapes

from .._typing import FloatArray
from ..edges import Edge, Line, Rectangle
from ..errors import CrfDeblurError
from .layers import drawn_shape, edge_layer, paint_edges, plane_drawn_on, stack_index
from .steps import Level, setting_edges

if TYPE_CHECKING:
    from .session import Session

DRAWN = ("added", "changed", "removed")  # events that come after the shapes have changed
ONE_SLICE = (
    "all edges must lie on one slice of the stack: draw on the slice of the others, or delete "
    "them first"
)


class EdgeDrawing:
    """Keeps the edges of the session and the Shapes layer of the photo alike.

    Parameters
    ----------
    session : Session
        Whose edges are drawn.
    """

    def __init__(self, session: "Session") -> None:
        self._session = session
        self._layers: WeakKeyDictionary[Layer, Shapes] = WeakKeyDictionary()
        self._written: WeakKeyDictionary[Layer, list[FloatArray]] = WeakKeyDictionary()
        self._painting = self._dragging = False
        session.photo_changed.connect(self.paint)
        session.edges_changed.connect(self.paint)
        session.selection_changed.connect(self._show_selection)

    @property
    def layer(self) -> Shapes | None:
        """The edge layer of the photo, if it has one in the viewer."""
        photo = self._session.photo
        layer = None if photo is None else self._layers.get(photo)
        return layer if layer is not None and layer in self._session.viewer.layers else None

    def begin(self, shape: str = "line") -> Shapes:
        """The edge layer of the photo, in front and ready for lines or rectangles."""
        layer = self._made()
        viewer = self._session.viewer
        viewer.layers.selection.active = layer
        layer.visible = True
        layer.mode = f"add_{shape}"
        return layer

    def adopted(self, layer: Shapes) -> tuple[list[Line | Rectangle], tuple[int, ...] | None]:
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
        planes = {plane_drawn_on(layer, number, photo) for number in numbers} - {()}
        if len(planes) > 1:
            raise CrfDeblurError(ONE_SLICE)
        return [drawn_shape(layer, n, photo) for n in numbers], next(iter(planes), None)

    def read(self) -> None:
        """Take over what was drawn, moved or deleted since the edges were last shown."""
        session, layer = self._session, self.layer
        if layer is None or session.photo is None:
            return
        before = session.state.edges
        edges = before.edges if before else ()
        known = {v.tobytes(): e for v, e in zip(self._written[layer], edges, strict=False)}
        items: list[Edge | Line | Rectangle] = []
        planes = {stack_index(before.plane)} if before and edges else set()
        for number, vertices in enumerate(layer.data):
            same = known.get(np.asarray(vertices).tobytes())
            items.append(same or drawn_shape(layer, number, session.photo))
            if same is None:
                planes.add(plane_drawn_on(layer, number, session.photo))
        if len(planes) > 1:
            raise CrfDeblurError(ONE_SLICE)
        if tuple(items) != edges:
            session.start(setting_edges(session, items, plane=next(iter(planes), None)))

    def paint(self) -> None:
        """Show the edges of the session, unless the mouse is just drawing one."""
        photo, edges = self._session.photo, self._session.state.edges
        if photo is None or self._dragging or (edges is None and self.layer is None):
            return
        layer = self._made()
        found = edges.edges if edges else ()
        groups = [edges.group_of(number) for number in range(len(found))] if edges else []
        plane = edges.plane if edges else self._session.plane(None)
        with self._quiet():
            self._written[layer] = paint_edges(layer, photo, plane, found, groups)

    def _made(self) -> Shapes:
        layer = self.layer
        if layer is not None:
            return layer
        photo, _ = self._session.source()
        layer = edge_layer(photo)
        self._layers[photo], self._written[layer] = layer, []
        layer.events.data.connect(self._on_data)
        layer.selected_data.events.items_changed.connect(self._on_selection)
        layer.mouse_drag_callbacks.append(self._on_drag)
        self._session.viewer.add_layer(layer)
        return layer

    def _on_data(self, event: Any) -> None:
        if self._painting or event.action not in DRAWN:
            return
        if event.source is not self.layer:
            text = "the photo of these edges was closed or is not the one worked on: choose it"
            self._session.say(text, Level.ERROR)
            return
        try:
            self.read()
        except CrfDeblurError as error:
            self._session.say(str(error), Level.ERROR)

    def _on_selection(self) -> None:
        layer, edges = self.layer, self._session.state.edges
        if self._painting or layer is None or edges is None:
            return
        chosen = [number for number in layer.selected_data if number < len(edges.edges)]
        self._session.selected = chosen[-1] if chosen else None

    def _on_drag(self, _: Shapes, event: Any) -> Iterator[None]:
        self._dragging = True
        yield
        while event.type == "mouse_move":
            yield
        self._dragging = False

    def _show_selection(self, number: int | None) -> None:
        layer = self.layer
        if layer is None or self._dragging:
            return
        with self._quiet():
            layer.selected_data = set() if number is None else {number}

    @contextmanager
    def _quiet(self) -> Iterator[None]:
        self._painting = True
        try:
            yield
        finally:
            self._painting = False
