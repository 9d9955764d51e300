"""The PSF: estimated, loaded, made, taken from a layer, edited by hand; one in all views."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from napari.layers import Image
from pytestqt.qtbot import QtBot

from napari_crfdeblur import CrfDeblurError, PsfEstimate, Session
from napari_crfdeblur._napari.docks import BlurDock
from napari_crfdeblur._napari.docks.blur import DISK, DRAWN, GAUSSIAN, LINE
from napari_crfdeblur._napari.docks.choices import AUTOMATIC, FROM_EDGES
from napari_crfdeblur._napari.session.state import EdgeSet
from napari_crfdeblur.psf import PsfStatus, RadonFit, cleared, disk, gaussian, line
from napari_crfdeblur.response import Gamma
from napari_crfdeblur.simulate import Simulated

LONG = 30000  # milliseconds: only a broken run takes as long
KEY = "napari-crfdeblur"


@pytest.fixture
def dock(qtbot: QtBot, session: Session) -> BlurDock:  # noqa: ARG001 - widgets need Qt
    session.set_response(Gamma(1.8))
    return BlurDock(session.viewer)


@pytest.fixture
def said(dock: BlurDock) -> list[str]:
    sentences: list[str] = []
    dock.session.said.connect(lambda message: sentences.append(message.text))
    return sentences


def shown(dock: BlurDock) -> Image:
    """The PSF layer; what it shows is what the session and the record have."""
    layer = dock.session.viewer.layers["panels [PSF]"]
    psf = dock.session.state.psf.psf
    np.testing.assert_allclose(layer.data, psf, atol=1e-7)
    np.testing.assert_array_equal(layer.metadata[KEY]["psf"], psf)
    return layer


def button(dock: BlurDock, text: str) -> Callable[[], Any]:
    """What a click on a button does."""
    (found,) = [each for each in dock._buttons if each.text == text]
    return lambda: found.changed.emit(True)


def test_the_button_estimates_what_the_script_estimates(
    qtbot: QtBot, dock: BlurDock, blurred: Simulated
) -> None:
    dock.session.photo.data = blurred.photo[:100, :140]
    button(dock, "Estimate the PSF")()
    assert dock.busy
    qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
    estimated = dock.session.state.psf.psf
    np.testing.assert_array_equal(dock.run().psf, estimated)
    shown(dock)


def test_the_dock_opens_in_a_viewer(
    qtbot: QtBot, make_napari_viewer_proxy: Any, blurred: Simulated
) -> None:
    viewer = make_napari_viewer_proxy()
    viewer.add_image(blurred.photo[:100, :140], name="panels")
    dock = BlurDock(viewer)
    viewer.window.add_dock_widget(dock)
    dock.session.set_response(Gamma(1.8))
    dock.run(block=False)
    qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
    assert "px: the PSF is" in dock._status.value
    shown(dock)


def test_only_the_drawn_region_is_looked_at(dock: BlurDock) -> None:
    layer = dock.draw_region()
    assert layer.name == "panels [region]"
    assert layer.mode == "add_rectangle"
    layer.add_rectangles([[10, 20], [30, 40]])
    layer.add_rectangles([[10.2, 20.4], [110.4, 150.4]])
    assert dock._where.value == DRAWN
    dock.run()
    pixels = np.asarray(dock.session.photo.data)[10:111, 20:151]
    alone = Session(ViewerModel(), Image(pixels, rgb=True))
    alone.set_response(dock.session.state.fitted.curve)
    np.testing.assert_array_equal(dock.session.state.psf.psf, alone.estimate_psf().psf)
    assert dock.draw_region() is layer


def test_a_psf_from_edges_can_be_undone(dock: BlurDock, found: EdgeSet) -> None:
    session = dock.session
    session.commit(session.photo, session.state.with_edges(found))
    session.set_psf(disk(4))
    dock._method.chosen = FROM_EDGES
    dock._method.field("size").value = 13
    psf = dock.run().psf
    shown(dock)
    assert session.state.sought.method == RadonFit(size=13)
    assert not np.array_equal(psf, disk(4))
    button(dock, "Undo")()
    np.testing.assert_array_equal(session.state.psf.psf, disk(4))
    shown(dock)


def test_without_edges_a_psf_from_them_is_refused_in_a_sentence(
    qtbot: QtBot, dock: BlurDock, said: list[str]
) -> None:
    dock._method.chosen = FROM_EDGES
    dock.run(block=False)
    qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
    assert said[-1].endswith("there are no edges to find the PSF from; find or draw edges first")
    assert dock.session.state.psf is None


def test_a_drawn_region_is_not_asked_for_if_edges_alone_count(
    dock: BlurDock, found: EdgeSet
) -> None:
    session = dock.session
    session.commit(session.photo, session.state.with_edges(found))
    dock.draw_region()  # and nothing drawn
    dock._method.chosen = FROM_EDGES
    assert not dock._where.enabled
    dock.run()
    assert session.state.sought.plane == session.source()[1].whole
    dock._method.chosen = AUTOMATIC
    assert dock._where.enabled


@pytest.mark.parametrize("rows", [(-30, 20), (140, 180)])
def test_a_region_is_cut_off_at_the_border(dock: BlurDock, rows: tuple[int, int]) -> None:
    dock.draw_region().add_rectangles([[rows[0], 7], [rows[1], 90]])
    assert dock._region() == (slice(max(rows[0], 0), min(rows[1] + 1, 150)), slice(7, 91))


def test_a_region_counts_in_pixels_of_a_placed_photo(qtbot: QtBot) -> None:  # noqa: ARG001
    viewer = ViewerModel()
    stack = np.random.default_rng(0).random((3, 40, 60)).astype(np.float32)
    viewer.add_image(stack, scale=(2, 0.5, 0.25), translate=(4, 1, -3))
    dock = BlurDock(viewer)
    viewer.dims.set_current_step(0, 1)
    layer = dock.draw_region()
    layer.add_rectangles([[1, 5, 10], [1, 5, 50], [1, 20, 50], [1, 20, 10]])
    assert dock._region() == (slice(1, 2), slice(5, 21), slice(10, 51))


def test_without_a_region_the_button_says_what_to_do(dock: BlurDock, said: list[str]) -> None:
    layer = dock.draw_region()
    dock.run(block=False)
    assert "drag a rectangle on the photo" in said[-1]
    layer.add_rectangles([[-50, -50], [-10, -10]])
    dock.run(block=False)
    assert "outside the photo" in said[-1]
    with pytest.raises(CrfDeblurError, match="outside"):
        dock.run()
    assert dock.session.state.psf is None


def test_without_a_response_the_button_says_what_to_do(
    qtbot: QtBot,  # noqa: ARG001
    session: Session,
) -> None:
    dock = BlurDock(session.viewer)
    sentences: list[str] = []
    session.said.connect(lambda message: sentences.append(message.text))
    dock.run(block=False)
    assert "no response yet" in sentences[-1]


def test_the_photo_is_divided_into_regions_and_back(
    qtbot: QtBot, dock: BlurDock, said: list[str], tmp_path: Path
) -> None:
    session = dock.session
    session.set_psf(disk(3))
    dock.draw_region()  # and nothing drawn: parts are those of the whole
    dock._method.chosen = "Xu & Jia"
    dock._method.field("size").value = 7
    dock._parts.value = (2, 2)
    assert not dock._where.enabled
    button(dock, "Estimate the PSF")()
    qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
    field = session.state.field
    assert field.grid == (2, 2)
    layer = session.viewer.layers["panels [PSF]"]
    np.testing.assert_allclose(layer.data, field.picture(), atol=1e-7)
    assert layer.metadata[KEY]["psf_field"]["type"] == "PsfField"
    assert "PSFs of 2 x 2 parts: 4 of 4 clearly determined" in dock._status.value
    np.testing.assert_allclose(dock._plot.axes.images[0].get_array(), field.picture())
    for text in ("Clear below, %", "Center"):
        button(dock, text)()
        assert "look for one of the whole photo" in said[-1]
    dock._edit.value = True
    assert dock._edit.value is False
    dock.save(tmp_path / "psf.json")
    button(dock, "Undo")()
    assert session.state.field is None
    np.testing.assert_array_equal(session.state.psf.psf, disk(3))
    shown(dock)
    dock.load(tmp_path / "psf.json")
    np.testing.assert_array_equal(session.state.field.psfs, field.psfs)
    session.set_psf(disk(2))
    dock.undo()
    np.testing.assert_array_equal(session.state.field.psfs, field.psfs)
    dock._parts.value = (1, 1)
    assert dock._where.enabled


def test_a_stack_of_pictures_is_the_psf_of_a_stack(
    qtbot: QtBot,  # noqa: ARG001 - widgets need Qt
    tmp_path: Path,
) -> None:
    viewer = ViewerModel()
    viewer.add_image(np.random.default_rng(0).random((6, 30, 40)).astype(np.float32), name="z")
    dock = BlurDock(viewer)
    bead = viewer.add_image(np.random.default_rng(1).random((3, 7, 5)), name="bead")
    viewer.add_image(np.ones((7, 7, 5)), name="deeper than the photo")
    assert [choice for choice in dock._layer.choices if choice] == [bead]
    dock._layer.value = bead
    button(dock, "Use layer")()
    psf = dock.session.state.psf.psf
    np.testing.assert_allclose(psf, bead.data / bead.data.sum())
    assert dock._status.value == "5 x 7 x 3 px: the PSF was given"
    np.testing.assert_allclose(dock._plot.axes.images[0].get_array(), psf.sum(axis=0))
    dock.save(tmp_path / "bead.tif")
    dock.session.set_psf(disk(2))
    dock.load(tmp_path / "bead.tif")
    np.testing.assert_allclose(dock.session.state.psf.psf, psf, rtol=1e-6)
    sentences: list[str] = []
    dock.session.said.connect(lambda message: sentences.append(message.text))
    button(dock, "Center")()
    assert "3 dimensions" in sentences[-1]
    dock.session.export("plot of the PSF", tmp_path / "psf.png")
    dock.session.export("report", tmp_path / "report.html")


@pytest.mark.parametrize("suffix", [".npy", ".tif", ".png"])
def test_a_psf_that_was_saved_can_be_loaded(dock: BlurDock, tmp_path: Path, suffix: str) -> None:
    dock.session.set_psf(line(9, 0.5))
    dock.save(tmp_path / f"psf{suffix}")
    dock.session.set_psf(disk(2))
    dock.load(tmp_path / f"psf{suffix}")
    np.testing.assert_allclose(dock.session.state.psf.psf, line(9, 0.5), atol=1e-4)
    shown(dock)


def test_a_file_that_is_no_psf_changes_nothing(dock: BlurDock, tmp_path: Path) -> None:
    dock.session.set_psf(line(9, 0.5))
    (tmp_path / "psf.npy").write_text("no array")
    with pytest.raises(CrfDeblurError, match="not a whole NPY file"):
        dock.load(tmp_path / "psf.npy")
    np.testing.assert_array_equal(dock.session.state.psf.psf, line(9, 0.5))


def test_without_a_psf_there_is_nothing_to_save_or_edit(
    dock: BlurDock, said: list[str], tmp_path: Path
) -> None:
    with pytest.raises(CrfDeblurError, match="no PSF yet"):
        dock.save(tmp_path / "psf.npy")
    for text in ("Clear below, %", "Center", "Undo"):
        said.clear()
        button(dock, text)()
        assert "no PSF yet" in said[-1] or "no change of the PSF" in said[-1]
    dock._edit.value = True
    assert "no PSF yet" in said[-1]
    assert dock._edit.value is False


@pytest.mark.parametrize(
    ("kind", "size", "psf"),
    [(LINE, 12, line(12, np.pi / 6)), (DISK, 3.5, disk(3.5)), (GAUSSIAN, 1.5, gaussian(1.5))],
)
def test_a_shape_becomes_the_psf(dock: BlurDock, kind: str, size: float, psf: Any) -> None:
    dock._kind.value, dock._size.value = kind, size
    np.testing.assert_allclose(dock._sketch.axes.images[0].get_array(), psf, atol=1e-12)
    button(dock, "Use this shape")()
    np.testing.assert_allclose(dock.session.state.psf.psf, psf, atol=1e-12)
    assert dock.session.state.psf.status is PsfStatus.GIVEN
    shown(dock)


def test_a_gray_layer_becomes_the_psf(dock: BlurDock) -> None:
    viewer = dock.session.viewer
    layer = viewer.add_image(np.arange(12.0).reshape(3, 4), name="point")
    viewer.add_image(np.ones((4, 5, 3)), rgb=True, name="colors")
    viewer.add_image(np.ones((4, 5, 6)), name="stack")
    assert [choice for choice in dock._layer.choices if choice] == [layer]
    dock._layer.value = layer
    button(dock, "Use layer")()
    assert dock.session.state.psf.psf.shape == (3, 5)
    np.testing.assert_allclose(dock.session.state.psf.psf[:, :4], layer.data / 66)


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (np.ones((4, 5, 3)), "has colors: a PSF is a grayscale picture"),
        (np.ones((4, 5, 6)), "is a stack: a PSF is a single picture"),
        (np.zeros((5, 5)), "zero everywhere"),
        (-np.eye(5), "negative values"),
    ],
)
def test_what_is_no_psf_is_refused_in_a_sentence(dock: BlurDock, data: Any, sentence: str) -> None:
    layer = Image(data, rgb=data.shape[-1] == 3)
    with pytest.raises(CrfDeblurError, match=sentence):
        dock.use(layer)
    assert dock.session.state.psf is None


def test_faint_parts_are_cleared_and_come_back(dock: BlurDock) -> None:
    psf = gaussian(1.5)
    dock.session.set_psf(psf)
    dock._faint.value = 20
    button(dock, "Clear below, %")()
    np.testing.assert_array_equal(dock.session.state.psf.psf, cleared(psf, 0.2))
    shown(dock)
    button(dock, "Undo")()
    np.testing.assert_array_equal(dock.session.state.psf.psf, psf)
    shown(dock)


def test_a_psf_is_centered(dock: BlurDock) -> None:
    psf = np.zeros((7, 9))
    psf[1, 2] = 1
    dock.session.set_psf(psf)
    button(dock, "Center")()
    centered = shown(dock).data
    assert np.argwhere(centered).tolist() == [[side // 2 for side in centered.shape]]


def test_undo_goes_back_through_whatever_gave_a_psf(dock: BlurDock, said: list[str]) -> None:
    psfs = [line(9, 0.5), disk(3), gaussian(1)]
    for psf in psfs:
        dock.session.set_psf(psf)
    for psf in psfs[1::-1]:
        dock.undo()
        np.testing.assert_array_equal(dock.session.state.psf.psf, psf)
    button(dock, "Undo")()
    assert said[-1] == "there is no change of the PSF to undo"


def drag(layer: Image, way: list[tuple[float, float]], *modifiers: str, button: int = 1) -> Any:
    """Drag the mouse over pixels of a layer, as the canvas tells it."""
    event = SimpleNamespace(type="mouse_press", modifiers=modifiers, button=button, handled=False)
    running = []
    for point in way:
        event.position = layer.data_to_world(point)
        if event.type == "mouse_press":
            running = [callback(layer, event) for callback in layer.mouse_drag_callbacks]
        for each in running:
            next(each, None)
        event.type = "mouse_move"
    event.type = "mouse_release"
    for each in running:
        next(each, None)
    return event


def test_the_mouse_erases_and_paints_while_a_key_is_held(dock: BlurDock) -> None:
    psf = np.full((7, 9), 1.0)
    psf[3, 4] = 4
    dock.session.set_psf(psf)
    dock._edit.value = True
    layer = shown(dock)
    assert dock.session.viewer.layers.selection.active is layer
    assert drag(layer, [(1, 2), (1, 6)], "Shift").handled
    assert not dock.session.state.psf.psf[1, 2:7].any()  # the pixels between, too
    assert np.count_nonzero(shown(dock).data == 0) == 5
    drag(layer, [(-3, -3), (0, 0)], "Control")
    psf = dock.session.state.psf.psf
    assert psf[0, 0] == psf[3, 4] == psf.max()
    shown(dock)
    dock.undo()
    dock.undo()
    assert dock.session.state.psf.psf[1, 2] > 0
    shown(dock)


def test_the_mouse_moves_the_picture_without_a_key(dock: BlurDock) -> None:
    dock.session.set_psf(disk(4))
    layer = shown(dock)
    dock._edit.value = True
    assert not drag(layer, [(1, 2), (1, 6)]).handled
    assert not drag(layer, [(1, 2), (1, 6)], "Shift", button=2).handled
    dock._edit.value = False
    assert not drag(layer, [(1, 2), (1, 6)], "Shift").handled
    np.testing.assert_array_equal(dock.session.state.psf.psf, disk(4))


def test_a_psf_cannot_be_erased_altogether(dock: BlurDock, said: list[str]) -> None:
    psf = np.zeros((5, 5))
    psf[2, 2] = 1
    dock.session.set_psf(psf)
    dock._edit.value = True
    drag(shown(dock), [(2, 1), (2, 3)], "Shift")
    assert "zero everywhere" in said[-1]
    np.testing.assert_array_equal(shown(dock).data, psf)


def test_editing_shows_the_psf_large_and_goes_back(dock: BlurDock) -> None:
    dock.session.set_psf(disk(4))
    camera = dock.session.viewer.scene.camera
    before = camera.center, camera.zoom
    dock._edit.value = True
    assert camera.zoom > 2 * before[1]
    dock._edit.value = False
    assert (camera.center, camera.zoom) == before


@pytest.mark.parametrize("lead", [(3,), (2, 3)])
def test_the_psf_of_a_stack_is_edited_like_that_of_a_picture(
    qtbot: QtBot,  # noqa: ARG001 - widgets need Qt
    viewer: ViewerModel,
    lead: tuple[int, ...],
) -> None:
    rng = np.random.default_rng(4)
    viewer.add_image(rng.random((*lead, 30, 40)), name="panels", scale=(*lead, 0.5, 0.25))
    dock = BlurDock(viewer)
    dock.session.set_psf(np.ones((7, 9)))
    camera = viewer.scene.camera
    before = camera.center, camera.zoom
    dock._edit.value = True
    layer = shown(dock)
    np.testing.assert_allclose(camera.center[-2:], layer.data_to_world((3, 4)))
    assert drag(layer, [(1, 2), (1, 6)], "Shift").handled
    assert not dock.session.state.psf.psf[1, 2:7].any()
    assert dock.session.state.psf.psf[2].all()
    shown(dock)
    dock._edit.value = False
    assert (camera.center, camera.zoom) == before


@pytest.mark.parametrize(("theme", "shade"), [("dark", "#f2b544"), ("light", "#8a5a00")])
def test_a_doubtful_psf_is_said_in_amber(dock: BlurDock, theme: str, shade: str) -> None:
    session = dock.session
    session.viewer.theme = theme
    session.set_psf(line(9, 0))
    assert dock._status.value == "11 x 1 px: the PSF was given"
    state = session.state
    doubtful = PsfEstimate(line(9, 0), PsfStatus.DOUBTFUL)
    session.commit(session.photo, replace(state, psf=doubtful))
    assert shade in dock._status.value
    assert "uncertain" in dock._status.value


def test_the_plot_follows_the_psf_and_the_photo(dock: BlurDock, viewer: ViewerModel) -> None:
    assert not dock._plot.axes.images
    dock.session.set_psf(disk(4))
    np.testing.assert_array_equal(dock._plot.axes.images[0].get_array(), disk(4))
    dock.photo = viewer.add_image(np.eye(50, dtype=np.uint8), name="another")
    assert not dock._plot.axes.images
    assert dock._status.value == "there is no PSF yet"
