"""The dock of the edges: buttons, table and profiles follow the session, and lead it."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from pytestqt.qtbot import QtBot
from qtpy.QtCore import QEvent, QPointF, Qt
from qtpy.QtGui import QMouseEvent
from qtpy.QtOpenGLWidgets import QOpenGLWidget
from qtpy.QtWidgets import QApplication
from scipy.ndimage import gaussian_filter

from napari_crfdeblur import CrfDeblurError, Session
from napari_crfdeblur._napari.docks import EdgesDock, following, table
from napari_crfdeblur._napari.docks import edges as module
from napari_crfdeblur._napari.docks.table import COLUMNS
from napari_crfdeblur._napari.preferences import Preferences
from napari_crfdeblur._napari.session.response import setting_response
from napari_crfdeblur._napari.session.state import EdgeSet
from napari_crfdeblur.edges import Edge, EdgeStatus, Line
from napari_crfdeblur.response import Gamma

UPRIGHT = Line((20.0, 70.0), (100.0, 70.0))
LEVEL = Line((80.0, 12.0), (80.0, 55.0))
OUTSIDE = Line((20.0, 190.0), (100.0, 190.0))
STATUS = list(COLUMNS).index("status")


def blocks() -> np.ndarray:
    """Three areas that meet in an upright and a level edge, blurred; not square."""
    photo = np.full((120, 160), 0.25)
    photo[80:] = 0.5
    photo[:, 70:] = 0.8
    noise = np.random.default_rng(4).normal(0, 0.002, photo.shape)
    return (gaussian_filter(photo, 2.0) + noise).astype(np.float32)


@pytest.fixture
def dock(viewer: ViewerModel, qtbot: QtBot) -> EdgesDock:
    """The dock, its live estimate off."""
    viewer.add_image(blocks(), name="blocks")
    dock = EdgesDock(viewer)
    qtbot.addWidget(dock.native)
    dock._again.value = False
    return dock


@pytest.fixture
def filled(dock: EdgesDock) -> EdgesDock:
    """With two good edges and a rejected one."""
    dock.session.set_edges([UPRIGHT, LEVEL, OUTSIDE], 12.0)
    return dock


@pytest.fixture
def settled(qtbot: QtBot) -> Callable[[EdgesDock], None]:
    """Wait until nothing is under way."""
    return lambda dock: qtbot.waitUntil(lambda: dock.runner.idle, timeout=10000)


def test_the_button_finds_the_edges_that_a_script_finds(
    dock: EdgesDock, settled: Callable[[EdgesDock], None]
) -> None:
    dock._extent.value = 12
    dock.run(block=False)
    settled(dock)
    other = ViewerModel()
    script = Session(other, other.add_image(blocks(), name="blocks"))
    script.detect_edges(12.0)
    assert dock.session.state.edges.edges == script.state.edges.edges
    assert dock.session.script() == script.script()


def test_edges_are_kept_when_others_are_sought_if_wanted(filled: EdgesDock) -> None:
    before = filled.session.state.edges.edges
    filled._keep.value = True
    filled.run()
    assert filled.session.state.edges.edges[:3] == before


def test_the_table_says_what_is_known_of_each_edge(filled: EdgesDock) -> None:
    upright, level, outside = filled._table.rows
    assert upright[:4] == ["0", "0", "90°", "rising"]
    assert upright[4:6] == ["0.25 - 0.80", f"{filled.session.state.edges.edges[0].width:.1f}"]
    assert level[1:4] == ["1", "0°", "rising"]
    assert upright[STATUS] == level[STATUS] == "good"
    assert outside[1] == outside[4] == ""
    assert outside[STATUS] == EdgeStatus.OUTSIDE.value
    assert filled._summary.value == "2 good edges in 2 orientations, 1 rejected"


def test_a_row_selects_the_edge_and_shows_its_profile(filled: EdgesDock) -> None:
    filled._table.table.selectRow(1)
    assert filled.session.selected == 1
    assert set(filled.session.drawing.layer.selected_data) == {1}
    assert filled._plot.axes.get_title() == "edge 1 in group 1"
    filled._table.table.selectRow(2)
    (text,) = filled._plot.axes.texts
    assert EdgeStatus.OUTSIDE.value in text.get_text()
    filled._table.table.clearSelection()
    assert filled.session.selected is None
    assert filled._plot.axes.get_title() == "largest group"


def test_an_edge_selected_on_the_canvas_is_selected_in_the_table(filled: EdgesDock) -> None:
    filled.session.drawing.layer.selected_data = {2}
    assert filled._table.selected == (2,)
    filled.session.drawing.layer.selected_data = set()
    assert filled._table.selected == ()


def test_the_right_edge_is_selected_whatever_the_rows_are_sorted_by(filled: EdgesDock) -> None:
    table = filled._table.table
    table.sortByColumn(list(COLUMNS).index("angle"), Qt.SortOrder.AscendingOrder)
    angles = [int(row[2][:-1]) for row in filled._table.rows]
    assert angles == sorted(angles)
    table.selectRow(0)
    assert filled.session.selected == int(filled._table.rows[0][0])
    filled.session.selected = 0
    (row,) = {item.row() for item in table.selectedItems()}
    assert filled._table.rows[row][0] == "0"


def test_selected_edges_are_deleted_and_brought_back(filled: EdgesDock) -> None:
    before = filled.session.state.edges
    assert not filled._delete.enabled
    filled._table.table.selectRow(0)
    filled.session.drawing.layer.selected_data = {0, 2}
    assert filled._delete.enabled
    filled.remove_selected()
    assert filled.session.state.edges.edges == before.edges[1:2]
    filled._undo.native.click()
    assert filled.session.state.edges is before
    assert len(filled._table.rows) == 3
    filled._redo.native.click()
    assert len(filled._table.rows) == 1


def test_undo_is_offered_only_if_there_is_something_to_undo(dock: EdgesDock) -> None:
    assert not dock._undo.enabled
    assert not dock._redo.enabled
    assert not dock._save.enabled
    dock.session.set_edges([UPRIGHT], 12.0)
    assert dock._undo.enabled
    dock._undo.native.click()
    assert dock._redo.enabled
    assert not dock._undo.enabled
    assert dock._summary.value == "no edges yet"


def test_edges_are_saved_and_loaded(
    filled: EdgesDock, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, settled: Any
) -> None:
    found = filled.session.state.edges.edges
    monkeypatch.setattr(module, "ask_save", lambda *_: tmp_path / "edges.csv")
    filled._save.native.click()
    with (tmp_path / "edges.csv").open(newline="") as file:
        assert len(list(csv.reader(file))) == 4
    filled.save(tmp_path / "edges.json")
    assert len(json.loads((tmp_path / "edges.json").read_text())["edges"]) == 3
    filled.session.remove_edges([0, 1, 2])
    monkeypatch.setattr(module, "ask_open", lambda *_: tmp_path / "edges.json")
    filled._ask_load()
    settled(filled)
    now = filled.session.state.edges.edges
    np.testing.assert_allclose([e.start for e in now], [e.start for e in found[:2]], atol=2)


def test_a_wrong_file_is_refused_in_a_sentence(filled: EdgesDock, tmp_path: Path) -> None:
    before = filled.session.state
    (tmp_path / "other.json").write_text("[]")
    filled.load(tmp_path / "other.json", block=False)
    assert "not a file of edges" in filled._message.value
    with pytest.raises(CrfDeblurError, match="not a file of edges"):
        filled.load(tmp_path / "other.json")
    assert filled.session.state is before


def test_shapes_of_other_layers_are_offered_and_used(filled: EdgesDock) -> None:
    assert filled._shapes.choices == (None,)
    filled.use(block=False)
    assert "add a Shapes layer" in filled._message.value
    points = np.array([UPRIGHT.start, UPRIGHT.end])
    shapes = filled.session.viewer.add_shapes([points], shape_type="line", name="mine")
    assert filled._shapes.choices == (None, shapes)
    filled._shapes.value = shapes
    filled.use()
    assert len(filled.session.state.edges.edges) == 1


def test_without_a_photo_every_button_says_so(viewer: ViewerModel, qtbot: QtBot) -> None:
    dock = EdgesDock(viewer)
    qtbot.addWidget(dock.native)
    for act in (dock.draw, lambda: dock.run(block=False)):
        dock.session.say("")
        act()
        assert "there is no photo yet" in dock._message.value


def test_a_cancelled_search_leaves_the_edges_as_they_were(
    filled: EdgesDock, settled: Callable[[EdgesDock], None]
) -> None:
    before = filled.session.state
    filled.run(block=False)
    assert filled.busy
    filled.cancel()
    settled(filled)
    assert filled.session.state is before


def test_a_line_drawn_during_a_search_is_kept(
    dock: EdgesDock, settled: Callable[[EdgesDock], None]
) -> None:
    dock._extent.value = 12
    layer = dock.session.draw_edges()
    dock.run(block=False)
    layer.add_lines(np.array([LEVEL.start, LEVEL.end]))
    settled(dock)
    found = dock.session.state.edges.edges
    separate = drain_edges(dock)
    assert {*separate} < {*found}
    assert len(found) == len(separate) + 1 == layer.nshapes


def drain_edges(dock: EdgesDock) -> tuple[Edge, ...]:
    """What the search alone finds."""
    other = ViewerModel()
    script = Session(other, other.add_image(blocks()))
    return script.detect_edges(dock._extent.value).edges


class TestLiveEstimate:
    @pytest.fixture
    def started(self, filled: EdgesDock, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
        """Arguments of the estimates that were started."""
        calls: list[Any] = []

        def keep(session: Session, method: Any, **how: Any) -> Any:
            calls.append({"method": method, **how})
            return setting_response(session, Gamma(2.0))

        monkeypatch.setattr(following, "estimating_response", keep)
        filled._again.value = True
        calls.clear()
        return calls

    def test_drawing_estimates_at_once(self, filled: EdgesDock, started: list[Any]) -> None:
        filled.session.set_edges([UPRIGHT, LEVEL])
        assert len(started) == 1
        filled.session.undo_edges()
        assert len(started) == 2

    def test_nothing_is_estimated_unless_wanted(
        self, filled: EdgesDock, started: list[Any]
    ) -> None:
        filled._again.value = False
        filled.session.set_edges([UPRIGHT, LEVEL])
        assert not started

    def test_a_response_that_was_given_stays(self, filled: EdgesDock, started: list[Any]) -> None:
        filled.session.set_response(Gamma(1.7))
        filled.session.set_edges([UPRIGHT, LEVEL])
        assert not started

    def test_another_photo_is_no_change_of_edges(
        self, filled: EdgesDock, started: list[Any]
    ) -> None:
        first = filled.session.photo
        filled.session.photo = filled.session.viewer.add_image(blocks()[::-1], name="other")
        filled.session.photo = first
        assert not started

    def test_a_failure_is_a_message(
        self,
        filled: EdgesDock,
        settled: Callable[[EdgesDock], None],
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        # The paper's method needs three edges of one orientation.
        monkeypatch.setattr(following, "preferences", lambda: Preferences(response="rank"))
        filled._again.value = True
        filled.session.set_edges([OUTSIDE, UPRIGHT])
        settled(filled)
        assert "estimating the response" in filled._message.value
        assert filled.session.state.fitted is None


def test_a_long_table_is_sorted_once(filled: EdgesDock, monkeypatch: pytest.MonkeyPatch) -> None:
    found = filled.session.state.edges
    many = EdgeSet(tuple(found.edges[n % 3] for n in range(250)), found.groups, 12.0, found.plane)
    compared, less = [], table._Cell.__lt__
    monkeypatch.setattr(table._Cell, "__lt__", lambda a, b: compared.append(a) or less(a, b))
    filled._table.fill(many)
    # Merge sort of n = 250 takes n log2 n = 2000 at most; rows that move with each cell take more.
    assert 0 < len(compared) <= 2000
    assert len(filled._table.rows) == 250


def test_a_proxied_viewer_is_taken(make_napari_viewer_proxy: Any, qtbot: QtBot) -> None:
    viewer = make_napari_viewer_proxy()
    photo = viewer.add_image(blocks())
    dock = EdgesDock(viewer)
    qtbot.addWidget(dock.native)
    dock._again.value = False
    dock.session.set_edges([UPRIGHT], 12.0)
    assert dock.photo == photo
    assert f"{photo.name} [edges]" in viewer.layers


def test_an_edge_is_drawn_with_a_real_mouse(make_napari_viewer: Any, qtbot: QtBot) -> None:
    viewer = make_napari_viewer(show=True)
    viewer.add_image(blocks(), name="blocks")
    dock = EdgesDock(viewer)
    dock._again.value = False
    viewer.window.add_dock_widget(dock, name="1 Edges")
    viewer.reset_view()
    dock.draw()
    canvas = dock.native.window().findChild(QOpenGLWidget)
    qtbot.waitUntil(lambda: canvas.isVisible() and canvas.width() > 100)
    qtbot.wait(100)

    def send(kind: QEvent.Type, row: float, column: float, held: Qt.MouseButton) -> None:
        camera = viewer.scene.camera
        y, x = (np.array([row, column]) - camera.center[-2:]) * camera.zoom
        place = QPointF(canvas.width() / 2 + x, canvas.height() / 2 + y)
        left, none = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton
        button = none if kind is QEvent.Type.MouseMove else left
        event = QMouseEvent(
            kind,
            place,
            QPointF(canvas.mapToGlobal(place.toPoint())),
            button,
            held,
            Qt.KeyboardModifier.NoModifier,
        )
        QApplication.sendEvent(canvas, event)
        QApplication.processEvents()

    left, none = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton
    send(QEvent.Type.MouseMove, 20, 70, none)
    send(QEvent.Type.MouseButtonPress, 20, 70, left)
    for row in (40, 60, 80, 100):
        send(QEvent.Type.MouseMove, row, 70, left)
    send(QEvent.Type.MouseButtonRelease, 100, 70, none)
    qtbot.waitUntil(lambda: dock.session.state.edges is not None, timeout=10000)
    (edge,) = dock.session.state.edges.edges
    assert edge.good
    assert dock._table.selected == (0,)
    qtbot.waitUntil(lambda: dock.runner.idle)
