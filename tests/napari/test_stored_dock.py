"""Stored cameras in the response dock: that of the photo is chosen, and no photo counts twice."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from napari.layers import Image as ImageLayer
from napari.layers._source import layer_source
from PIL import Image
from pytestqt.qtbot import QtBot

from napari_crfdeblur import CrfDeblurError
from napari_crfdeblur._napari.cameras import UNKNOWN
from napari_crfdeblur._napari.docks import ResponseDock
from napari_crfdeblur._napari.docks import response as module
from napari_crfdeblur._napari.session.step import Level
from napari_crfdeblur.estimate import GivenResponse, MaximumLikelihood
from napari_crfdeblur.io import (
    CameraKey,
    CameraRecord,
    CountedPhoto,
    read_camera,
    stored_cameras,
    write_camera,
)
from napari_crfdeblur.response import Cameras, Gamma, around

pytestmark = pytest.mark.usefixtures("qapp")
KEY = CameraKey("FUJIFILM", "X100", "contrast hard")
OTHER = CameraKey("", "scanner in the attic")
ELSEWHERE = CountedPhoto("else.png", "0" * 64)


def opened(viewer: ViewerModel, path: Path, pixels: Any, software: str = "") -> ImageLayer:
    """A layer as napari opens the file of a photo of that camera."""
    exif = Image.Exif()
    exif.update({0x010F: "FUJIFILM", 0x0110: "X100"})
    if software:
        exif[0x0131] = software
    exif.get_ifd(0x8769)[0xA408] = 2
    Image.fromarray(pixels).save(path, exif=exif)
    with layer_source(path=str(path)):
        return viewer.add_image(pixels, name=path.stem)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An empty folder of cameras."""
    (tmp_path / "cameras").mkdir()
    return tmp_path / "cameras"


@pytest.fixture
def dock(viewer: ViewerModel, blurred: Any, found: Any, tmp_path: Path, qtbot: QtBot) -> Any:
    """The dock on a photo in a file of a camera, with a few edges."""
    layer = opened(viewer, tmp_path / "one.png", blurred.photo)
    dock = ResponseDock(viewer)
    qtbot.addWidget(dock.native)
    dock.photo = layer
    dock.session.set_edges([edge for edge in found.edges if edge.good][:12])
    return dock


@pytest.fixture
def said(dock: ResponseDock) -> list[Any]:
    """What the user was told."""
    messages: list[Any] = []
    dock.session.said.connect(messages.append)
    return messages


def looked(dock: ResponseDock, folder: Path, qtbot: QtBot) -> None:
    dock.use_cameras(folder)
    qtbot.waitUntil(lambda: dock._stored.known is not None, timeout=20000)


def told(dock: ResponseDock) -> str:
    return str(dock._stored[0][0].value)


def store(folder: Path, key: CameraKey, *photos: CountedPhoto) -> CameraRecord:
    record = CameraRecord(key, around(Gamma(1.8), 0.1), photos or (ELSEWHERE,))
    write_camera(folder, record)
    return record


def test_without_a_folder_there_is_no_row(dock: ResponseDock) -> None:
    assert dock._stored.folder is None
    assert not dock._stored.visible
    assert all(not isinstance(each, CameraKey) for each in dock._camera.offered)
    with pytest.raises(CrfDeblurError, match="choose one with Stored"):
        dock.keep()


def test_a_new_camera_is_named_and_stored(dock: ResponseDock, folder: Path, qtbot: QtBot) -> None:
    looked(dock, folder, qtbot)
    assert "FUJIFILM X100 (contrast hard)" in told(dock)
    assert "nothing is stored" in told(dock)
    assert dock._camera.chosen is Cameras.DIGITAL
    estimate = dock.run().estimates[0]
    assert "1 photo now" in dock.keep()
    record = read_camera(folder, KEY)
    assert [photo.name for photo in record.photos] == ["one.png"]
    np.testing.assert_allclose(record.posterior.mean, estimate.posterior.mean)
    assert dock._camera.chosen == KEY
    assert "counted already" in told(dock)


def test_the_camera_of_the_photo_is_chosen_and_is_where_the_estimate_starts(
    dock: ResponseDock, folder: Path, qtbot: QtBot
) -> None:
    record = store(folder, KEY)
    store(folder, OTHER)
    looked(dock, folder, qtbot)
    assert dock._camera.chosen == KEY
    assert {KEY, OTHER} < {*dock._camera.offered}
    np.testing.assert_array_equal(dock._fit().prior.mean, record.posterior.mean)
    dock.run()
    assert "2 photos now" in dock.keep()
    assert len(read_camera(folder, KEY).photos) == 2


def test_a_photo_counts_once(dock: ResponseDock, folder: Path, qtbot: QtBot) -> None:
    looked(dock, folder, qtbot)
    dock.run()
    dock.keep()
    before = (folder / KEY.file_name).read_bytes()
    method = dock._fit()
    assert isinstance(method, GivenResponse)
    dock.run()
    assert "as before" in dock.keep()
    assert (folder / KEY.file_name).read_bytes() == before


def test_the_same_pixels_in_another_file_are_the_same_photo(
    dock: ResponseDock, folder: Path, blurred: Any, tmp_path: Path, qtbot: QtBot
) -> None:
    looked(dock, folder, qtbot)
    dock.run()
    dock.keep()
    dock.photo = opened(dock.session.viewer, tmp_path / "copy.png", blurred.photo)
    qtbot.waitUntil(lambda: dock._stored.known is not None, timeout=20000)
    assert "copy.png: counted already" in told(dock)
    dock.photo = opened(dock.session.viewer, tmp_path / "two.png", blurred.photo[:, ::-1])
    qtbot.waitUntil(lambda: dock._stored.known is not None, timeout=20000)
    assert dock._camera.chosen == KEY
    assert "counted already" not in told(dock)
    assert isinstance(dock._fit(), MaximumLikelihood)


def test_an_estimate_that_started_elsewhere_is_not_stored(
    dock: ResponseDock, folder: Path, qtbot: QtBot
) -> None:
    store(folder, KEY)
    before = (folder / KEY.file_name).read_bytes()
    looked(dock, folder, qtbot)
    dock.assume(Cameras.DIGITAL)
    assert "choose it" in told(dock)
    dock.run()
    with pytest.raises(CrfDeblurError, match=r"did not start from what is stored of FUJIFILM"):
        dock.keep()
    assert (folder / KEY.file_name).read_bytes() == before


def test_what_cannot_be_stored_is_refused_with_advice(
    dock: ResponseDock, folder: Path, blurred: Any, qtbot: QtBot
) -> None:
    looked(dock, folder, qtbot)
    with pytest.raises(CrfDeblurError, match="no response yet"):
        dock.keep()
    dock.session.set_response(Gamma(1.7))
    with pytest.raises(CrfDeblurError, match="estimate first"):
        dock.keep()
    dock.session.estimate_response(MaximumLikelihood(around(Gamma(1.8))))
    with pytest.raises(CrfDeblurError, match="choose a kind of camera"):
        dock.keep()
    dock.session.estimate_response(per_channel=True)
    with pytest.raises(CrfDeblurError, match="without one curve per channel"):
        dock.keep()
    other = dock.session.viewer.add_image(blurred.photo[:75, ::-1], name="other")
    dock.session.estimate_response(others=[other])
    with pytest.raises(CrfDeblurError, match="further photos"):
        dock.keep()
    assert not stored_cameras(folder)


def test_a_stored_camera_is_no_start_for_three_curves(
    dock: ResponseDock, folder: Path, qtbot: QtBot
) -> None:
    store(folder, KEY)
    looked(dock, folder, qtbot)
    dock.native.show()
    dock._per_channel.value = True
    with pytest.raises(CrfDeblurError, match="one curve for all channels"):
        dock.run()
    dock.native.hide()


def test_a_photo_that_was_edited_is_of_no_camera_by_itself(
    dock: ResponseDock, folder: Path, blurred: Any, tmp_path: Path, qtbot: QtBot
) -> None:
    store(folder, KEY)
    photo = blurred.photo[::-1]
    dock.photo = opened(dock.session.viewer, tmp_path / "two.png", photo, "GIMP 2.10")
    looked(dock, folder, qtbot)
    assert dock._camera.chosen is Cameras.DIGITAL
    assert "edited with GIMP" in told(dock)


def test_a_photo_without_data_gets_a_camera_by_name(
    dock: ResponseDock, folder: Path, blurred: Any, found: Any, qtbot: QtBot, monkeypatch: Any
) -> None:
    dock.photo = dock.session.viewer.add_image(blurred.photo, name="scan")
    looked(dock, folder, qtbot)
    assert told(dock) == UNKNOWN
    dock.session.set_edges([edge for edge in found.edges if edge.good][:12])
    dock.run()
    with pytest.raises(CrfDeblurError, match="does not say which camera"):
        dock.keep()
    monkeypatch.setattr(module, "ask_name", lambda *_: None)
    dock._ask_keep()
    assert not stored_cameras(folder)
    monkeypatch.setattr(module, "ask_name", lambda *_: OTHER.model)
    dock._ask_keep()
    qtbot.waitUntil(lambda: not dock.busy and dock._camera.chosen == OTHER, timeout=20000)
    assert read_camera(folder, OTHER).photos[0].name == "scan"


def test_the_next_photo_does_not_start_from_the_last_camera(
    dock: ResponseDock, folder: Path, blurred: Any, qtbot: QtBot
) -> None:
    store(folder, KEY)
    looked(dock, folder, qtbot)
    assert dock._camera.chosen == KEY
    dock.photo = dock.session.viewer.add_image(blurred.photo, name="unknown")
    assert dock._camera.chosen is Cameras.DIGITAL
    qtbot.waitUntil(lambda: dock._stored.known is not None, timeout=20000)
    assert dock._camera.chosen is Cameras.DIGITAL
    assert KEY in dock._camera.offered


def test_a_slice_of_a_stack_is_a_photo(
    dock: ResponseDock, folder: Path, blurred: Any, qtbot: QtBot
) -> None:
    gray = blurred.photo[..., 0]
    dock.photo = dock.session.viewer.add_image(np.stack([gray, gray[::-1]]), name="stack")
    looked(dock, folder, qtbot)
    assert dock._stored.known.photo == CountedPhoto.of("stack", gray)


def test_other_files_and_damaged_ones_are_passed_over(
    dock: ResponseDock, folder: Path, qtbot: QtBot
) -> None:
    store(folder, KEY)
    (folder / "notes.json").write_text("{}")
    (folder / OTHER.file_name).write_text("no JSON")
    (folder / "copy.json").write_bytes((folder / KEY.file_name).read_bytes())
    assert [record.key for record in stored_cameras(folder)] == [KEY]
    looked(dock, folder, qtbot)
    assert [each for each in dock._camera.offered if isinstance(each, CameraKey)] == [KEY]


def test_a_folder_that_is_gone_is_told(
    dock: ResponseDock, folder: Path, qtbot: QtBot, said: list[Any], monkeypatch: Any
) -> None:
    monkeypatch.setattr(module, "ask_folder", lambda *_: folder / "gone")
    dock._ask_cameras()
    qtbot.waitUntil(lambda: bool(said), timeout=20000)
    assert "no such folder" in said[-1].text
    assert said[-1].level is Level.ERROR
    assert dock.session.state.fitted is None


def test_closing_while_it_looks_takes_nothing(
    dock: ResponseDock, folder: Path, qtbot: QtBot
) -> None:
    store(folder, KEY)
    dock.use_cameras(folder)
    assert not dock.runner.idle
    dock._closed()
    assert dock.runner.idle
    qtbot.wait(200)
    assert dock._stored.known is None
    assert dock._camera.chosen is Cameras.DIGITAL
