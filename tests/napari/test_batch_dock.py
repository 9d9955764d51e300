"""Many photos, exports, scripts and repeats from the widget."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from magicgui.widgets import PushButton
from pytestqt.qtbot import QtBot
from qtpy.QtWidgets import QApplication

from napari_crfdeblur import CrfDeblurError, Session
from napari_crfdeblur._napari.docks import BatchDock
from napari_crfdeblur._napari.docks import batch as batch_module
from napari_crfdeblur._napari.session.export import EXPORTS
from napari_crfdeblur.io import read_photo, write_photo
from napari_crfdeblur.psf import line
from napari_crfdeblur.response import Gamma
from napari_crfdeblur.simulate import Simulated

LONG = 20000  # milliseconds: only a broken run takes as long


@pytest.fixture
def dock(qtbot: QtBot, session: Session) -> BatchDock:  # noqa: ARG001 - widgets need Qt
    session.set_response(Gamma(1.8))
    session.set_psf(line(5, 0.3))
    return BatchDock(session.viewer)


@pytest.fixture(scope="module")
def full(qapp: QApplication, done: Session) -> BatchDock:  # noqa: ARG001 - widgets need Qt
    """The dock where there is all that can be exported."""
    return BatchDock(done.viewer)


def press(dock: Any, text: str) -> None:
    """Press the button that says so."""
    for widget in dock.native.findChildren(type(PushButton().native)):
        if widget.text() == text:
            widget.click()
            return
    raise AssertionError(f"no button says {text}")


def said(session: Session) -> list[str]:
    sentences: list[str] = []
    session.said.connect(lambda message: sentences.append(message.text))
    return sentences


def test_the_button_does_what_the_verb_does(
    qtbot: QtBot, dock: BatchDock, blurred: Simulated
) -> None:
    session = dock.session
    layer = session.viewer.add_image(blurred.photo[::-1], name="other")
    expected = session.restore_layers([layer]).done["other"].data
    dock.choose([layer])
    press(dock, "Deblur the chosen layers")
    assert dock.busy
    qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
    made = session.viewer.layers["other [deblurred] [1]"]
    np.testing.assert_array_equal(made.data, expected)


def test_nothing_chosen_is_said(dock: BatchDock) -> None:
    sentences = said(dock.session)
    press(dock, "Deblur the chosen layers")
    assert "choose one or more" in sentences[-1]
    with pytest.raises(CrfDeblurError, match="choose one or more"):
        dock.run()


def test_files_are_asked_for_and_deblurred(
    qtbot: QtBot,
    dock: BatchDock,
    blurred: Simulated,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    write_photo(tmp_path / "a.png", blurred.photo)
    (tmp_path / "b.png").write_text("no picture", encoding="utf-8")
    files = [tmp_path / "a.png", tmp_path / "b.png"]
    monkeypatch.setattr(batch_module, "ask_open_many", lambda *_: files)
    monkeypatch.setattr(batch_module, "ask_folder", lambda *_: tmp_path / "out")
    sentences = said(dock.session)
    press(dock, "Deblur files...")
    qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
    assert (tmp_path / "out" / "a-deblurred.png").exists()
    assert "deblurred 1 of 2; b.png was passed over" in sentences[-1]


def test_a_cancelled_batch_keeps_what_is_done_and_goes_on_there(
    qtbot: QtBot, dock: BatchDock, blurred: Simulated, tmp_path: Path
) -> None:
    dock._method.chosen = "Wiener"
    files, out = [], tmp_path / "out"
    for number in range(4):
        files.append(tmp_path / f"{number}.png")
        write_photo(files[-1], blurred.photo[: 110 + 10 * number])
    files.insert(1, tmp_path / "bad.png")
    files[1].write_text("no picture", encoding="utf-8")
    dock.run_files(files, out, block=False)
    qtbot.waitUntil(lambda: (out / "0-deblurred.png").exists(), timeout=LONG)
    dock.cancel()
    qtbot.waitUntil(lambda: dock.runner.idle, timeout=LONG)
    done = {path: path.stat().st_mtime_ns for path in out.glob("*.png")}
    assert all(read_photo(path).shape[1] == 210 for path in done)  # whole files alone
    sentences = said(dock.session)
    result = dock.run_files(files, out)
    assert [path.name for path in sorted(out.glob("*.png"))] == [
        f"{number}-deblurred.png" for number in range(4)
    ]
    assert {path: path.stat().st_mtime_ns for path in done} == done
    assert set(result.kept) == {path.name.replace("-deblurred", "") for path in done}
    expected = f"deblurred {4 - len(done)} of 5; {len(done)} done before; bad.png was passed over"
    assert expected in sentences[-1]


@pytest.mark.parametrize("what", EXPORTS)
def test_everything_that_is_offered_can_be_exported(
    qtbot: QtBot, full: BatchDock, tmp_path: Path, what: str
) -> None:
    dock = full
    for suffix in EXPORTS[what][1]:
        path = tmp_path / f"export{suffix}"
        dock.export(what, path, block=False)
        qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
        assert path.stat().st_size > 100
        if suffix == ".json":
            json.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("what", EXPORTS)
@pytest.mark.usefixtures("qtbot")
def test_what_is_not_there_yet_cannot_be_exported(viewer: Any, tmp_path: Path, what: str) -> None:
    dock = BatchDock(viewer)
    with pytest.raises(CrfDeblurError, match="yet"):
        dock.export(what, tmp_path / f"export{EXPORTS[what][1][0]}")
    assert not list(tmp_path.iterdir())


def test_a_kind_of_file_that_cannot_be_written_is_refused(dock: BatchDock, tmp_path: Path) -> None:
    with pytest.raises(CrfDeblurError, match=r"\.html"):
        dock.export("report", tmp_path / "report.docx")


def test_the_script_is_put_on_the_clipboard(dock: BatchDock) -> None:
    press(dock, "Copy as script")
    clipboard = QApplication.clipboard()
    assert clipboard is not None
    assert clipboard.text() == dock.session.script()


def test_a_session_is_repeated_on_another_photo(
    qtbot: QtBot, dock: BatchDock, blurred: Simulated, tmp_path: Path
) -> None:
    session = dock.session
    expected = session.restore().data
    session.save(tmp_path / "session.json")
    dock.photo = session.viewer.add_image(blurred.photo, name="again")
    dock.repeat(tmp_path / "session.json", block=False)
    qtbot.waitUntil(lambda: not dock.busy, timeout=LONG)
    np.testing.assert_array_equal(session.state.restored.data, expected)
    assert session.state.restored.name == "again [deblurred]"


def test_it_opens_in_a_window(make_napari_viewer_proxy: Any, blurred: Simulated) -> None:
    viewer = make_napari_viewer_proxy()
    viewer.add_image(blurred.photo, name="panels")
    dock = BatchDock(viewer)
    viewer.window.add_dock_widget(dock)
    assert dock.photo == viewer.layers["panels"]
