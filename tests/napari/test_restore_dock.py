"""Restoring: previewed, done whole or in part, and compared with the photo."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from pytestqt.qtbot import QtBot

from napari_crfdeblur import Session
from napari_crfdeblur._napari import preferences
from napari_crfdeblur._napari.docks import RestoreDock, restore
from napari_crfdeblur._napari.docks.restore import SLICE, VISIBLE, WHOLE
from napari_crfdeblur.deconvolution import RichardsonLucy, Wiener
from napari_crfdeblur.psf import disk, line
from napari_crfdeblur.response import Gamma, clipped_share
from napari_crfdeblur.simulate import Simulated

LONG = 30000  # milliseconds: only a broken run takes as long
MADE = [f"panels [{kind}]" for kind in ("linear", "deblurred linear", "trust", "deblurred")]


def known(session: Session) -> Session:
    session.set_response(Gamma(1.8))
    session.set_psf(line(7, 0.4))
    return session


@pytest.fixture
def dock(qtbot: QtBot, session: Session) -> RestoreDock:  # noqa: ARG001 - widgets need Qt
    dock = RestoreDock(known(session).viewer)
    dock._method.chosen = "Wiener"  # the quickest
    return dock


@pytest.fixture
def said(dock: RestoreDock) -> list[str]:
    sentences: list[str] = []
    dock.session.said.connect(lambda message: sentences.append(message.text))
    return sentences


def click(dock: RestoreDock, text: str) -> None:
    (found,) = [each for each in dock._buttons if each.text == text]
    found.changed.emit(True)


def names(dock: RestoreDock) -> list[str]:
    return [layer.name for layer in dock.session.viewer.layers]


def ended(qtbot: QtBot, dock: RestoreDock) -> None:
    qtbot.waitUntil(lambda: dock.runner.idle, timeout=LONG)


def test_the_button_gives_what_the_script_gives(
    qtbot: QtBot, dock: RestoreDock, blurred: Simulated
) -> None:
    click(dock, "Restore")
    ended(qtbot, dock)
    assert names(dock) == ["panels", "panels [PSF]", *MADE]
    viewer = ViewerModel()
    other = known(Session(viewer, viewer.add_image(blurred.photo, name="panels")))
    other.restore(dock._method.method)
    for layer in viewer.layers:
        mine = dock.session.viewer.layers[layer.name]
        np.testing.assert_array_equal(mine.data, layer.data)
        assert mine.metadata == layer.metadata


def test_the_small_buttons_give_what_the_large_one_gives(qtbot: QtBot, dock: RestoreDock) -> None:
    whole = dock.run().data
    for text in ("Linearize", "Deconvolve", "Re-apply"):
        click(dock, text)
        ended(qtbot, dock)
    assert names(dock)[-4:] == [f"{name} [1]" for name in MADE]
    np.testing.assert_array_equal(dock.session.state.restored.data, whole)


def test_the_dock_opens_in_a_viewer(
    qtbot: QtBot, make_napari_viewer_proxy: Any, blurred: Simulated
) -> None:
    viewer = make_napari_viewer_proxy()
    viewer.add_image(blurred.photo, name="panels")
    dock = RestoreDock(viewer)
    viewer.window.add_dock_widget(dock)
    known(dock.session)
    dock.run(block=False)
    ended(qtbot, dock)
    assert names(dock) == ["panels", "panels [PSF]", *MADE]
    assert dock._shown.value == "shown: deblurred"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [("Restore", "no response"), ("Preview", "no PSF"), ("Linearize", "no response")],
)
def test_what_is_missing_is_said(qtbot: QtBot, session: Session, text: str, sentence: str) -> None:  # noqa: ARG001
    dock = RestoreDock(session.viewer)
    sentences: list[str] = []
    session.said.connect(lambda message: sentences.append(message.text))
    click(dock, text)
    assert sentence in sentences[-1]
    assert names(dock) == ["panels"]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("Deconvolve", "linearize it first"),
        ("Re-apply", "deconvolve first"),
        ("Before / after", "restore it first"),
        ("Side by side", "restore it first"),
    ],
)
def test_steps_in_the_wrong_order_are_refused_in_a_sentence(
    dock: RestoreDock, said: list[str], text: str, sentence: str
) -> None:
    click(dock, text)
    assert sentence in said[-1]
    assert names(dock) == ["panels", "panels [PSF]"]


def test_gamma_is_put_beside_the_result(
    qtbot: QtBot, dock: RestoreDock, blurred: Simulated
) -> None:
    dock.session.set_psf(blurred.psf)  # with a wrong one both would be the photo
    dock._beside.value = True
    click(dock, "Restore")
    ended(qtbot, dock)
    assert names(dock)[-2:] == ["panels [deblurred, gamma 2.2]", "panels [deblurred]"]
    assert dock._shown.value == "shown: deblurred"
    both = [dock.session.viewer.layers[name].data for name in names(dock)[-2:]]
    assert not np.array_equal(*both)
    assert dock.run() is dock.session.state.restored
    assert names(dock)[-2:] == ["panels [deblurred, gamma 2.2] [1]", "panels [deblurred] [1]"]


def test_gamma_is_not_put_beside_another_photo(
    qtbot: QtBot, dock: RestoreDock, said: list[str]
) -> None:
    dock._beside.value = True
    other = dock.session.viewer.add_image(np.eye(40, dtype=np.uint8), name="other")
    click(dock, "Restore")
    dock.photo = other
    ended(qtbot, dock)
    assert "another photo was chosen" in said[-1]
    assert not any("gamma" in name for name in names(dock))


def test_preferences_are_where_it_starts(
    qtbot: QtBot,  # noqa: ARG001
    session: Session,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    chosen = preferences.Preferences(deconvolution="wiener", compare=True)
    monkeypatch.setattr(restore, "preferences", lambda: chosen)
    dock = RestoreDock(session.viewer)
    assert isinstance(dock._method.method, Wiener)
    assert dock._beside.value is True
    monkeypatch.setattr(restore, "preferences", preferences.Preferences)
    assert RestoreDock(session.viewer)._method.method is None


def test_a_preview_takes_the_place_of_the_last_one(qtbot: QtBot, dock: RestoreDock) -> None:
    for _ in range(2):
        click(dock, "Preview")
        ended(qtbot, dock)
        assert names(dock) == ["panels", "panels [PSF]", "panels [preview]"]
        assert dock._shown.value == "shown: preview"
    click(dock, "Remove preview")
    assert names(dock) == ["panels", "panels [PSF]"]
    click(dock, "Remove preview")
    assert dock._shown.value == "shown: photo"


def test_only_the_visible_part_is_restored(dock: RestoreDock) -> None:
    dock.photo.corner_pixels = np.array([[20, 30], [99, 179]])
    dock._what.value = VISIBLE
    restored = dock.run()
    assert restored.data.shape == (80, 150, 3)
    assert list(restored.translate) == [20, 30]


def test_a_slice_is_a_choice_for_stacks_only(qtbot: QtBot, dock: RestoreDock) -> None:  # noqa: ARG001
    assert list(dock._what.choices) == [WHOLE, VISIBLE]
    viewer, rng = dock.session.viewer, np.random.default_rng(0)
    stack = viewer.add_image(rng.integers(0, 255, (3, 40, 50), np.uint8), name="stack")
    dock.photo = stack
    known(dock.session)
    assert list(dock._what.choices) == [WHOLE, VISIBLE, SLICE]
    dock._what.value = SLICE
    viewer.dims.set_current_step(0, 2)
    restored = dock.run()
    assert restored.data.shape == (1, 40, 50)
    assert list(restored.translate) == [2, 0, 0]


def test_before_and_after_is_a_click(dock: RestoreDock) -> None:
    dock.run()
    for text in ("shown: photo", "shown: deblurred", "shown: photo"):
        click(dock, "Before / after")
        assert dock._shown.value == text
    dock.session.state.restored.visible = True  # with the eye of the layer list
    assert dock._shown.value == "shown: deblurred"


def test_side_by_side_goes_back_to_what_it_was(dock: RestoreDock) -> None:
    dock._beside.value = True
    dock.run()
    viewer = dock.session.viewer
    grid, camera = viewer.canvas.grid, viewer.scene.camera
    viewer.layers["panels [linear]"].visible = False
    grid.stride, camera.zoom = 3, 2.5

    def view() -> tuple[Any, ...]:
        visible = tuple(layer.visible for layer in viewer.layers)
        return visible, grid.enabled, grid.shape, grid.stride, camera.zoom, camera.center

    before = view()
    click(dock, "Side by side")
    assert grid.enabled
    at = {grid.position(n, viewer.layers): x.name for n, x in enumerate(viewer.layers) if x.visible}
    assert at == {
        (0, 0): "panels",
        (0, 1): "panels [deblurred, gamma 2.2]",
        (0, 2): "panels [deblurred]",
    }
    viewer.layers.remove("panels [PSF]")
    click(dock, "Back to one")
    after = view()
    assert after[1:] == before[1:]
    assert after[0] == (before[0][0], *before[0][2:])


def test_clipped_values_are_counted_and_said(
    qtbot: QtBot, dock: RestoreDock, blurred: Simulated
) -> None:
    # so bright that what rings leaves the range above, and stays possible
    dock.session.photo.data = 255 - (255 - blurred.photo) // 3
    known(dock.session).set_psf(disk(6))
    dock.native.show()
    click(dock, "Restore")
    ended(qtbot, dock)
    share = clipped_share(dock.session.state.sharp.layer.data)
    assert share > 0.02
    assert dock._clipped.value.startswith(f"{share:.0%} of the deconvolved values")
    assert dock._clipped.visible
    dock.session.set_psf(np.ones((1, 1)))
    dock.run()
    ended(qtbot, dock)
    assert not dock._clipped.visible
    dock.native.hide()


def after_progress(qtbot: QtBot, dock: RestoreDock, act: Callable[[], Any]) -> None:
    """Do something as soon as a job has reported."""
    seen: list[Any] = []
    dock.runner.changed.connect(lambda: seen.append(dock.runner.progress))
    click(dock, "Restore")
    qtbot.waitUntil(lambda: any(seen), timeout=LONG)
    act()


def test_a_cancelled_restoration_leaves_no_layers(qtbot: QtBot, dock: RestoreDock) -> None:
    dock._method.chosen = "sparse (IRLS)"
    dock._beside.value = True
    after_progress(qtbot, dock, dock.cancel)
    assert not dock.busy
    qtbot.wait(300)
    assert names(dock) == ["panels", "panels [PSF]"]
    assert dock.session.state.linear is None


def test_a_photo_that_is_closed_stops_its_restoration(qtbot: QtBot, dock: RestoreDock) -> None:
    dock._method.chosen = "sparse (IRLS)"
    after_progress(qtbot, dock, lambda: dock.session.viewer.layers.remove("panels"))
    assert not dock.busy
    qtbot.wait(300)
    assert names(dock) == ["panels [PSF]"]


def test_a_value_that_does_not_fit_is_said_beside_it(dock: RestoreDock, said: list[str]) -> None:
    dock._method.chosen = "Richardson-Lucy"
    dock._method._fields["iterations"].value = 0
    assert "expected" in dock._method.refusal
    assert dock._method.method == RichardsonLucy()
    assert not said
