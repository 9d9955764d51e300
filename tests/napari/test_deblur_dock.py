"""All in one, and what every dock has: photo, white level, progress, messages."""

from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from pytestqt.qtbot import QtBot

from napari_crfdeblur import CrfDeblurError, Session
from napari_crfdeblur._napari.docks import DeblurDock
from napari_crfdeblur.response import Cameras
from napari_crfdeblur.simulate import Simulated

LONG = 30000  # milliseconds: only a broken run takes as long


@pytest.fixture
def dock(qtbot: QtBot, session: Session) -> DeblurDock:  # noqa: ARG001 - widgets need Qt
    return DeblurDock(session.viewer)


def test_the_button_gives_what_the_script_gives(
    qtbot: QtBot, dock: DeblurDock, deblurred: Session
) -> None:
    dock.run(block=False)
    assert dock.busy
    qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
    viewer = deblurred.viewer
    assert {layer.name for layer in dock.session.viewer.layers} == {
        layer.name for layer in viewer.layers
    }
    for layer in viewer.layers:
        mine = dock.session.viewer.layers[layer.name]
        for one, two in zip(mine.data, layer.data, strict=True):
            np.testing.assert_array_equal(one, two)
        assert mine.metadata == layer.metadata
    assert dock._message.value.count("response: ") == 1


def test_a_blocking_run_returns_the_layer(dock: DeblurDock) -> None:
    dock._response.chosen, dock._method.chosen = "gamma", "Wiener"  # the quickest
    dock._extent.value = 5
    assert dock.run().name == "panels [deblurred]"


def test_what_is_assumed_of_the_camera_is_a_parameter_of_the_response(dock: DeblurDock) -> None:
    assert dock._response.method.prior is Cameras.DIGITAL
    dock._response.field("prior").value = Cameras.SRGB
    assert dock._response.method.prior is Cameras.SRGB


def test_a_cancelled_run_leaves_no_trace(qtbot: QtBot, dock: DeblurDock) -> None:
    seen = []
    dock.runner.changed.connect(lambda: seen.append(dock.runner.progress))
    dock.run(block=False)
    qtbot.waitUntil(lambda: any(seen), timeout=LONG)
    dock.cancel()
    assert not dock.busy
    qtbot.wait(200)
    assert [layer.name for layer in dock.session.viewer.layers] == ["panels"]
    assert dock.session.state.found == (None,) * 4


def test_an_error_is_shown_and_nothing_has_changed(qtbot: QtBot) -> None:
    viewer = ViewerModel()
    viewer.add_image(np.full((40, 50), 255, np.uint8), name="white")
    dock = DeblurDock(viewer)
    sentences = []
    dock.session.said.connect(lambda message: sentences.append(message.text))
    dock.run(block=False)
    qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
    assert "saturated throughout; use a shorter exposure" in sentences[-1]
    with pytest.raises(CrfDeblurError, match="saturated"):
        dock.run()
    assert len(viewer.layers) == 1


def test_without_a_photo_the_button_says_so(qtbot: QtBot) -> None:  # noqa: ARG001
    dock = DeblurDock(ViewerModel())
    sentences = []
    dock.session.said.connect(lambda message: sentences.append(message.text))
    dock.run(block=False)
    assert "no photo yet" in sentences[-1]


def test_without_a_viewer_there_is_no_dock(qtbot: QtBot) -> None:  # noqa: ARG001
    with pytest.raises(ValueError, match="viewer"):
        DeblurDock()


def test_the_photo_of_one_dock_is_the_photo_of_all(dock: DeblurDock) -> None:
    viewer = dock.session.viewer
    other = DeblurDock(viewer)
    layer = viewer.add_image(np.zeros((20, 30), np.uint8), name="second")
    dock.photo = layer
    assert other.photo is layer
    dock.session.white = 200
    assert other.session.white == 200


def test_two_viewers_do_not_know_of_each_other(dock: DeblurDock) -> None:
    other = DeblurDock(ViewerModel())
    assert other.photo is None
    assert other.runner is not dock.runner


def test_a_photo_that_is_renamed_or_closed_is_followed(dock: DeblurDock) -> None:
    dock.session.photo.name = "renamed"
    assert dock.session.photo.name == "renamed"
    dock.session.viewer.layers.clear()
    assert dock.photo is None


def test_it_opens_in_a_window_and_closing_it_in_mid_job_is_clean(
    qtbot: QtBot, make_napari_viewer_proxy: Any, blurred: Simulated
) -> None:
    viewer = make_napari_viewer_proxy()
    viewer.add_image(blurred.photo, name="panels")
    dock = DeblurDock(viewer)
    viewer.window.add_dock_widget(dock)
    runner = dock.runner
    dock.run(block=False)
    qtbot.waitUntil(lambda: runner.progress is not None, timeout=LONG)
    viewer.close()
    qtbot.waitUntil(lambda: not runner.busy, timeout=LONG)
