"""Verbs of a session that find, draw and change edges."""

from collections.abc import Sequence
from pathlib import Path

from napari.layers import Shapes

from ...edges import Edge, Line, Rectangle
from ...errors import CrfDeblurError
from ...io import read_edges
from .. import steps
from ..drawing import EdgeDrawing
from ..pixels import unwrapped
from ..regions import stack_index
from ..state import Action, EdgeSet, State
from ..workspace import Workspace


class EdgeVerbs(Workspace):
    """Verbs of a session that find, draw and change edges."""

    drawing: EdgeDrawing

    def detect_edges(
        self,
        blur_extent: float | None = None,
        *,
        add: bool = False,
        plane: Sequence[int] | None = None,
    ) -> EdgeSet:
        """Find straight edges, and show them as lines colored by orientation.

        Parameters
        ----------
        blur_extent : float, optional
            Largest width of a blurred edge in pixels; judged from the photo if not given.
        add : bool
            Keep the edges that there are already.
        plane : sequence of int, optional
            Index of the plane in a stack; by default the one that is shown.

        Raises
        ------
        CrfDeblurError
            There is no photo, or it cannot be worked on.
        """
        return self.do(steps.detecting_edges(self, blur_extent, add=add, plane=plane))

    def set_edges(
        self,
        items: Sequence[Edge | Line | Rectangle] = (),
        blur_extent: float | None = None,
        *,
        plane: Sequence[int] | None = None,
    ) -> EdgeSet:
        """Use these edges: lines and rectangles are refined first, edges taken as they are.

        Parameters
        ----------
        items : sequence of Edge, Line or Rectangle
            In (row, column) pixels of the photo; none to do without edges.
        blur_extent, plane
            As in :meth:`detect_edges`.
        """
        return self.do(steps.setting_edges(self, items, blur_extent, plane=plane))

    def draw_edges(self, shape: str = "line") -> Shapes:
        """Make the layer on which edges are drawn, ready for a ``line`` or a ``rectangle``."""
        return self.drawing.begin(shape)

    def use_edges_of(self, layer: Shapes) -> EdgeSet:
        """Use the lines and rectangles of any Shapes layer; its own coordinates count."""
        items, plane = self.drawing.adopted(unwrapped(layer))
        return self.set_edges(items, plane=plane)

    def remove_edges(self, numbers: Sequence[int]) -> EdgeSet:
        """Do without the edges of these numbers."""
        return self.do(steps.removing_edges(self, numbers))

    def load_edges(self, path: Path | str) -> EdgeSet:
        """Use the edges of a JSON file; they are refined on this photo."""
        return self.set_edges(read_edges(Path(path)))

    def undo_edges(self) -> None:
        """Take back the last change of the edges."""
        self._turn_edges(self.state.undone(), "there is no change of the edges to undo")

    def redo_edges(self) -> None:
        """Do again what :meth:`undo_edges` took back."""
        self._turn_edges(self.state.redone(), "there is no change of the edges to redo")

    def _turn_edges(self, state: State | None, otherwise: str) -> None:
        if state is None:
            raise CrfDeblurError(otherwise)
        photo = self._required_photo()
        edges = state.edges
        items = edges.edges if edges else ()
        plane = stack_index(edges.plane) if edges else ()
        self.commit(photo, state.after(Action.of("set_edges", items=tuple(items), plane=plane)))
