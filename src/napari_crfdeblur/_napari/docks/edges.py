"""Edges: found, drawn, loaded, looked at one by one, and taken out again."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from magicgui.widgets import CheckBox, ComboBox, Container, Label, PushButton
from magicgui.widgets.bases import Widget
from napari.layers import Shapes

from ...errors import CrfDeblurError
from ...io import read_edges, write_edges
from ...io.edges import SUFFIXES
from ...profiles import ProfileGroup
from ...report import draw_profiles
from ...report.content import normalized
from ..preferences import preferences
from ..session.edges import detecting_edges, removing_edges, setting_edges
from ..session.state import EdgeSet
from ..session.step import Step
from .base import Dock, Followed
from .files import ask_open, ask_save
from .following import Following
from .forms import blur_extent_box, row
from .keys import FIND_EDGES
from .plots import Plot, palette_of
from .table import EdgeTable, summary

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NO_PROFILES = "the profiles of the edges are shown here"


class EdgesDock(Dock):
    """The straight edges of a photo, grouped by orientation."""

    def body(self) -> list[Widget]:
        """How edges are found, drawn and changed; the table and the profiles."""
        chosen = preferences()
        self._extent = blur_extent_box(chosen.blur_extent)
        self._keep = CheckBox(
            text="keep the present edges",
            value=False,
            tooltip="add the edges that are found to those that there are",
        )
        self._again = CheckBox(
            text="estimate the response at once",
            value=chosen.live,
            tooltip="estimate the response whenever edges are drawn, moved or deleted: the curve "
            "follows at once, and is confirmed after a pause; one that was loaded or chosen stays",
        )
        self._following = Following(self.session, self.runner, lambda: bool(self._again.value))
        self._summary = Label(value="")
        self._table = EdgeTable()
        self._plot = Plot(self.session.viewer, self._draw)
        return [
            Container(widgets=[self._extent]),
            *self._sources(),
            self._changes(),
            self._summary,
            self._table,
            self._plot,
            self._again,
        ]

    def _sources(self) -> list[Widget]:
        """Where edges come from."""
        find = self.button(
            "Find edges", "find straight edges in the photo", lambda: self.run(block=False)
        )
        tip = "press at one end of an edge, move to the other, and release; then the next one"
        lines = _button("Draw lines", tip, self.draw)
        tip = "draw rectangles over edges: press at one corner, move to the opposite, and release"
        rectangles = _button("Draw rectangles", tip, lambda: self.draw("rectangle"))
        self._shapes = ComboBox(
            choices=self._other_shapes,
            nullable=True,
            value=None,
            tooltip="a Shapes layer with lines or rectangles over edges, wherever it comes from",
        )
        use = self.button(
            "Use these shapes",
            "take the lines and rectangles of the layer as edges, instead of the present ones",
            lambda: self.use(block=False),
        )
        return [
            row(find, self._keep),
            row(lines, rectangles),
            row(self._shapes, use),
        ]

    def _changes(self) -> Widget:
        """What can be done with edges that there are."""
        session = self.session
        tip = "take back the last change of the edges"
        self._undo = _button("Undo", tip, lambda: self.attempt(session.undo_edges))
        tip = "do again what was taken back"
        self._redo = _button("Redo", tip, lambda: self.attempt(session.redo_edges))
        tip = "do without the selected edges"
        self._delete = _button("Delete", tip, lambda: self.remove_selected(block=False))
        tip = "replace the edges by those of a JSON file, refined on this photo"
        load = self.button("Load...", tip, self._ask_load)
        tip = "save all edges as JSON, or as CSV for a spreadsheet"
        self._save = _button("Save...", tip, self._ask_save)
        return row(self._undo, self._redo, self._delete, load, self._save)

    def step(self) -> Step[EdgeSet, EdgeSet]:
        """Find edges."""
        extent = self._extent.value or None
        return detecting_edges(self.session, extent, add=bool(self._keep.value))

    def draw(self, shape: str = "line") -> None:
        """Let the mouse draw a ``line`` or a ``rectangle`` over an edge."""
        self.attempt(lambda: self.session.draw_edges(shape))

    def use(self, layer: Shapes | None = None, *, block: bool = True) -> Any:
        """Take the shapes of a layer as edges, by default of the chosen one."""

        def step() -> Step[EdgeSet, EdgeSet]:
            chosen = layer if layer is not None else self._shapes.value
            if chosen is None:
                raise CrfDeblurError("there are no other shapes: add a Shapes layer, and draw")
            items, plane = self.session.drawing.adopted(chosen)
            return setting_edges(self.session, items, self._extent.value or None, plane=plane)

        return self.begin(step, block=block)

    def load(self, path: Path | str, *, block: bool = True) -> Any:
        """Take the edges of a JSON file, refined on this photo."""

        def step() -> Step[EdgeSet, EdgeSet]:
            items = read_edges(Path(path))
            return setting_edges(self.session, items, self._extent.value or None)

        return self.begin(step, block=block)

    def save(self, path: Path | str) -> None:
        """Save all edges as JSON or CSV."""
        write_edges(Path(path), self.session.required_edges().edges)

    def remove_selected(self, *, block: bool = True) -> Any:
        """Do without the edges that are selected."""
        numbers = self.session.drawing.chosen
        return self.begin(lambda: removing_edges(self.session, numbers), block=block)

    def shortcuts(self) -> dict[str, Callable[[], Any]]:
        """Those of all widgets; the edges are found as it is set here."""
        return super().shortcuts() | {FIND_EDGES: lambda: self.run(block=False)}

    def refresh(self) -> None:
        """Show the photo of the session, and which other shapes there are."""
        super().refresh()
        self._shapes.reset_choices()

    def followed(self) -> Followed:
        """The edges, and which is selected."""
        session = self.session
        return [
            *super().followed(),
            (session.photo_changed, self._photo_changed),
            (session.edges_changing, self._following.foresee),
            (session.edges_changed, self._edges_changed),
            (session.selection_changed, self._selection_changed),
        ]

    def _connect(self) -> None:
        super()._connect()
        self._seen = self.session.state.edges
        self._table.picked.connect(self._pick)
        self._again.changed.connect(self._follow_if)
        self._show_edges()

    def _other_shapes(self, _: Any) -> list[tuple[str, Shapes]]:
        session = self.session
        shapes = [layer for layer in session.viewer.layers if isinstance(layer, Shapes)]
        return [(s.name, s) for s in shapes if not session.drawing.owns(s)]

    def _closed(self) -> None:
        super()._closed()
        self._following.end()

    def _photo_changed(self) -> None:
        self._following.end()
        self._remember()

    def _follow_if(self, wanted: bool) -> None:
        """Estimate from the edges as they are, or follow them no more."""
        if wanted:
            self._following.estimate()
        else:
            self._following.end()

    def _remember(self) -> None:
        self._seen = self.session.state.edges

    def _edges_changed(self) -> None:
        state = self.session.state
        drawn = state.edges is not self._seen and state.by_hand
        self._remember()
        self._show_edges()
        if drawn:
            self._following.follow()

    def _show_edges(self) -> None:
        edges = self.session.state.edges
        self._summary.value = summary(edges)
        self._table.fill(edges)
        self._selection_changed(self.session.selected)

    def _selection_changed(self, number: int | None) -> None:
        self._table.select(number)
        self._plot.redraw()
        self._show_progress()

    def _pick(self, numbers: Sequence[int]) -> None:
        self.session.drawing.choose(numbers)

    def _show_progress(self) -> None:
        super()._show_progress()
        state, idle = self.session.state, not self.runner.busy
        self._undo.enabled = idle and bool(state.undo)
        self._redo.enabled = idle and bool(state.redo)
        self._delete.enabled = idle and self.session.selected is not None
        self._save.enabled = state.edges is not None and bool(state.edges.edges)

    def _draw(self, ax: "Axes") -> None:
        """The profiles of the group of the selected edge, or of the largest group."""
        edges, number = self.session.state.edges, self.session.selected
        group = -1 if edges is None or number is None else edges.group_numbers[number]
        if edges is None or not edges.groups or (number is not None and group < 0):
            _say(ax, NO_PROFILES if edges is None or number is None else _reason(edges, number))
            return
        shown = edges.groups[max(group, 0)]
        palette = palette_of(self.session.viewer)
        draw_profiles(ax, shown, palette=palette)
        if number is None:
            ax.set_title("largest group", fontsize=8)
            return
        ax.set_title(f"edge {number} in group {group}", fontsize=8)
        rows = normalized(_of_edge(shown, number))
        ax.plot(shown.position, rows.T, color=palette.ink, linewidth=1.8)

    def _ask_load(self) -> None:
        path = ask_open(self.native, "Load edges", SUFFIXES[:1])
        if path is not None:
            self.load(path, block=False)

    def _ask_save(self) -> None:
        path = ask_save(self.native, "Save edges", SUFFIXES)
        if path is not None:
            self.attempt(lambda: self.save(path))


def _button(text: str, tooltip: str, act: Callable[[], Any]) -> PushButton:
    """A button that does something quick."""
    button = PushButton(text=text, tooltip=tooltip)
    button.changed.connect(lambda: act())
    return button


def _of_edge(group: ProfileGroup, number: int) -> ProfileGroup:
    return group.select(np.array([source.edge == number for source in group.sources]))


def _reason(edges: EdgeSet, number: int) -> str:
    return f"edge {number} has no profile:\n{edges.edges[number].status.value}"


def _say(ax: "Axes", text: str) -> None:
    ax.set_axis_off()
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", fontsize=8, wrap=True)
