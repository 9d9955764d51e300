"""Keys work while a widget is open; closing it or its viewer in mid-job is clean."""

import subprocess
import sys
from typing import Any

import pytest
from napari._app_model import get_app_model
from napari.components import ViewerModel
from napari.utils.key_bindings import coerce_keybinding
from pytestqt.qtbot import QtBot

from napari_crfdeblur import Session
from napari_crfdeblur._napari.docks import DeblurDock, RestoreDock
from napari_crfdeblur._napari.docks.base import Dock
from napari_crfdeblur._napari.docks.keys import FIND_EDGES, FLIP, PREVIEW, UNDO_EDGES, Keys
from napari_crfdeblur.psf import line
from napari_crfdeblur.response import Gamma
from napari_crfdeblur.simulate import Simulated

LONG = 30000  # milliseconds: only a broken run takes as long


def bound(viewer: Any) -> set[str]:
    keys = {key: coerce_keybinding(key) for key in (FLIP, FIND_EDGES, UNDO_EDGES, PREVIEW)}
    return {key for key, binding in keys.items() if binding in viewer.keymap}


def press(viewer: Any, key: str) -> None:
    viewer.keymap[coerce_keybinding(key)](viewer)


def test_keys_are_bound_once_and_unbound_with_the_last_widget(viewer: ViewerModel) -> None:
    keys, one, two = Keys.of(viewer), object(), object()
    done: list[str] = []
    keys.add(one, {FLIP: lambda: done.append("one")})
    keys.add(two, {FLIP: lambda: done.append("two"), PREVIEW: lambda: done.append("preview")})
    assert Keys.of(viewer) is keys
    assert bound(viewer) == {FLIP, PREVIEW}
    press(viewer, FLIP)
    press(viewer, PREVIEW)
    keys.remove(two)
    assert bound(viewer) == {FLIP}
    press(viewer, FLIP)
    assert done == ["two", "preview", "one"]
    assert keys.in_use
    keys.remove(one)
    assert not bound(viewer)
    assert not keys.in_use


def test_a_key_that_has_a_meaning_keeps_it(viewer: ViewerModel) -> None:
    viewer.bind_key(FLIP, print)
    keys, owner = Keys.of(viewer), object()
    keys.add(owner, {FLIP: lambda: None, PREVIEW: lambda: None})
    assert viewer.keymap[coerce_keybinding(FLIP)] is print
    viewer.bind_key(PREVIEW, repr, overwrite=True)
    keys.remove(owner)
    assert viewer.keymap[coerce_keybinding(FLIP)] is print
    assert viewer.keymap[coerce_keybinding(PREVIEW)] is repr


def test_a_key_of_napari_keeps_its_meaning(
    viewer: ViewerModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(ViewerModel.class_keymap, coerce_keybinding(FLIP), print)
    Keys.of(viewer).add(viewer, {FLIP: lambda: None})
    assert not bound(viewer)


def test_two_viewers_are_independent() -> None:
    one, two = ViewerModel(), ViewerModel()
    Keys.of(one).add(one, {FLIP: lambda: None})
    assert bound(one)
    assert not bound(two)


def test_no_key_of_ours_is_a_shortcut_of_napari(make_napari_viewer: Any) -> None:
    viewer = make_napari_viewer()
    menus = {str(each.keybinding) for each in get_app_model().keybindings}
    assert "Ctrl+Alt+P" in menus
    for key in (FLIP, FIND_EDGES, UNDO_EDGES, PREVIEW):
        binding = coerce_keybinding(key)
        assert str(binding) not in menus
        assert binding not in type(viewer).class_keymap


def docked(viewer: Any, kind: type[Dock]) -> tuple[Dock, Any]:
    dock = kind(viewer)
    return dock, viewer.window.add_dock_widget(dock)


def test_keys_do_what_buttons_do(qtbot: QtBot, make_napari_viewer: Any, blurred: Simulated) -> None:
    viewer = make_napari_viewer()
    viewer.add_image(blurred.photo, name="panels")
    dock, _ = docked(viewer, RestoreDock)
    session = dock.session
    assert bound(viewer) == {FLIP, FIND_EDGES, UNDO_EDGES, PREVIEW}
    sentences: list[str] = []
    session.said.connect(lambda message: sentences.append(message.text))
    press(viewer, FLIP)
    assert "restore it first" in sentences[-1]
    press(viewer, FIND_EDGES)
    press(viewer, FIND_EDGES)
    assert "wait for its end" in sentences[-1]
    qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
    assert session.state.edges.edges
    press(viewer, UNDO_EDGES)
    assert session.state.edges is None
    session.set_response(Gamma(1.8))
    session.set_psf(line(7, 0.4))
    press(viewer, PREVIEW)
    qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
    assert "panels [preview]" in [layer.name for layer in viewer.layers]


def test_closing_the_last_dock_stops_its_job_and_frees_the_keys(
    qtbot: QtBot, make_napari_viewer: Any, blurred: Simulated
) -> None:
    viewer = make_napari_viewer()
    viewer.add_image(blurred.photo, name="panels")
    first, first_frame = docked(viewer, DeblurDock)
    second, second_frame = docked(viewer, RestoreDock)
    first.run(block=False)
    second_frame.hide()  # it is still there
    assert PREVIEW in bound(viewer)
    viewer.window.remove_dock_widget(second_frame)  # what its cross does
    assert bound(viewer) == {FLIP, FIND_EDGES, UNDO_EDGES}
    assert first.busy
    viewer.window.remove_dock_widget(first_frame)
    assert not bound(viewer)
    assert not first.runner.busy
    qtbot.wait(200)
    assert len(viewer.layers) == 1
    viewer.window.add_dock_widget(first)
    assert bound(viewer) == {FLIP, FIND_EDGES, UNDO_EDGES}
    assert second.session is first.session


def test_closing_the_viewer_in_mid_job_stops_it(
    qtbot: QtBot, make_napari_viewer: Any, blurred: Simulated
) -> None:
    viewer, other = make_napari_viewer(), make_napari_viewer()
    for each in (viewer, other):
        each.add_image(blurred.photo, name="panels")
    dock, _ = docked(viewer, DeblurDock)
    spared, _ = docked(other, DeblurDock)
    dock.run(block=False)
    spared.run(block=False)
    seen: list[Any] = []
    dock.runner.changed.connect(lambda: seen.append(dock.runner.progress))
    qtbot.waitUntil(lambda: any(seen), timeout=LONG)
    viewer.close()
    assert dock.runner.idle
    assert spared.busy
    qtbot.wait(100)
    assert not bound(viewer)
    assert bound(other)
    spared.cancel()


SCRIPT = """
import sys
import napari
import numpy as np
from qtpy.QtCore import QTimer
from qtpy.QtWidgets import QApplication
from napari_crfdeblur._napari.docks import DeblurDock

viewer = napari.Viewer(show=True)
viewer.add_image(np.kron(np.random.default_rng(0).random((30, 40)), np.ones((25, 25))))
dock = DeblurDock(viewer)
viewer.window.add_dock_widget(dock)
sys.excepthook = lambda *error: (sys.__excepthook__(*error), __import__("os")._exit(3))
dock.run(block=False)

def close():
    if not dock.busy or dock.runner.progress is None:
        QTimer.singleShot(20, close)
        return
    window = [w for w in QApplication.topLevelWidgets() if w.inherits("QMainWindow")][0]
    {closing}

QTimer.singleShot(20, close)
napari.run()
print("left", flush=True)
"""


@pytest.mark.parametrize("closing", ["window.close()", "window.close(quit_app=True)"])
def test_a_window_closed_in_mid_job_ends_the_program(closing: str) -> None:
    code = SCRIPT.replace("{closing}", closing)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "left" in done.stdout
    assert "QThread" not in done.stderr
    assert "Traceback" not in done.stderr


def test_a_session_without_a_widget_binds_nothing(session: Session) -> None:
    session.set_response(Gamma(1.8))
    assert not bound(session.viewer)
