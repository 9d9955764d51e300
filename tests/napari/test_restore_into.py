"""Results larger than memory go into a file, and are shown from there."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import dask.array as da
import numpy as np
import pytest
from napari.components import ViewerModel
from pytestqt.qtbot import QtBot

from napari_crfdeblur import CrfDeblurError, DeblurOptions, Session
from napari_crfdeblur._napari.docks import RestoreDock, restore
from napari_crfdeblur._napari.session import memory
from napari_crfdeblur._napari.session.large import restoring_into
from napari_crfdeblur.deconvolution import RichardsonLucy, Tiled, Wiener
from napari_crfdeblur.io import record_from, write_photo
from napari_crfdeblur.large import restore_large
from napari_crfdeblur.pipeline.record import pixels_of
from napari_crfdeblur.psf import PsfField, PsfStatus, camera_shake, delta, line
from napari_crfdeblur.response import Gamma
from napari_crfdeblur.simulate import Simulated

LONG = 30000  # milliseconds: only a broken run takes as long
KEY = "napari-crfdeblur"
METHOD = Wiener(weight=0.01)


def known(pixels: Any, name: str = "photo", **options: Any) -> Session:
    viewer = ViewerModel()
    session = Session(viewer, viewer.add_image(pixels, name=name), **options)
    session.set_response(Gamma(1.8))
    session.set_psf(line(7, 0.4))
    return session


@pytest.mark.parametrize("suffix", [".tif", ".zarr"])
@pytest.mark.parametrize("lazily", [False, True])
def test_the_result_is_in_the_file_and_in_the_layer(
    blurred: Simulated, tmp_path: Path, suffix: str, lazily: bool
) -> None:
    photo = blurred.photo
    session = known(da.from_array(photo, chunks=(100, 100, 3)) if lazily else photo)
    layer = session.restore_into(tmp_path / f"out{suffix}", METHOD)
    assert isinstance(layer.data, da.Array)
    expected = restore_large(photo, Gamma(1.8), line(7, 0.4), METHOD, guard=True).compute()
    np.testing.assert_array_equal(layer.data.compute(), expected)
    whole = known(photo).restore(METHOD).data
    # Tiles of a small photo are the whole; what is measured on a sample is alike.
    assert np.abs(expected.astype(float) - whole).mean() < 0.5
    assert session.state.restored is layer
    record = record_from(layer.metadata[KEY], "the layer")
    assert record.tiled
    assert record.result == pixels_of("photo", expected)
    assert record.photo == pixels_of("photo", photo)
    assert [path.name for path in tmp_path.iterdir()] == [f"out{suffix}"]


def test_a_stack_and_its_white_level_go_through(tmp_path: Path, blurred: Simulated) -> None:
    gray = (blurred.photo[..., 1].astype(np.uint16) * 4)[:110, :130]
    stack = da.from_array(np.stack([gray, gray[::-1]]), chunks=(1, 50, 130))
    session = known(stack, white=1020.0)
    session.photo.scale = (2, 0.5, 0.5)
    layer = session.restore_into(tmp_path / "stack.tif", METHOD)
    assert (layer.data.shape, layer.data.dtype) == ((2, 110, 130), np.uint16)
    np.testing.assert_array_equal(layer.scale, session.photo.scale)
    whole = session.restore(METHOD).data
    # the guard judges all slices of a file together
    assert np.abs(layer.data.compute().astype(float) - whole).mean() < 5
    assert whole.max() > 600  # in the numbers of the layer


def test_nothing_is_overwritten_unless_it_is_wanted(tmp_path: Path, blurred: Simulated) -> None:
    write_photo(tmp_path / "photo.tif", blurred.photo[:60, :70])
    before = (tmp_path / "photo.tif").read_bytes()
    session = known(blurred.photo[:60, :70])
    with pytest.raises(CrfDeblurError, match="is there already"):
        session.restore_into(tmp_path / "photo.tif", METHOD)
    session.photo._source = session.photo.source.model_copy(
        update={"path": str(tmp_path / "photo.tif")}
    )
    with pytest.raises(CrfDeblurError, match="is read by this run"):
        session.restore_into(tmp_path / "photo.tif", METHOD, overwrite=True)
    assert (tmp_path / "photo.tif").read_bytes() == before
    assert session.state.restored is None


def test_a_record_of_tiles_names_no_file_and_writes_none(
    tmp_path: Path, blurred: Simulated
) -> None:
    session = known(blurred.photo[:60, :70])
    session.restore_into(tmp_path / "out.tif", METHOD)
    assert str(tmp_path) not in json.dumps(session.record())
    assert "out.tif" not in session.script()
    assert "write_photo" not in session.script()  # tiles are not done again in memory
    other = known(blurred.photo[:80, :70])
    before = other.state
    with pytest.raises(CrfDeblurError, match="done in tiles"):
        other.repeat(session.record())
    assert other.state is before
    assert [path.name for path in tmp_path.iterdir()] == ["out.tif"]


def test_what_was_stopped_leaves_no_file_and_changes_nothing(
    tmp_path: Path, blurred: Simulated
) -> None:
    session = known(blurred.photo)
    before = session.state
    step = restoring_into(session, tmp_path / "out.tif", Tiled(METHOD, side=128))
    stages = [next(step.job).stage for _ in range(4)]
    step.job.close()
    assert stages[-1] == "tiles"
    assert session.state is before
    assert not list(tmp_path.iterdir())


def test_what_fits_in_no_memory_is_refused_with_what_to_do(
    monkeypatch: pytest.MonkeyPatch, blurred: Simulated, tmp_path: Path
) -> None:
    session = known(blurred.photo)
    needed = blurred.photo.size * (9 + 4)  # and three planes of float32 for three channels
    free = SimpleNamespace(available=2 * needed - 1)
    monkeypatch.setattr(memory.psutil, "virtual_memory", lambda: free)
    before = session.state
    for attempt in (session.linearize, session.restore, session.compare_with, session.deblur):
        with pytest.raises(CrfDeblurError, match="restore into a file, or a part"):
            attempt()
    with pytest.raises(CrfDeblurError, match="restore into a file"):
        session.deblur(DeblurOptions(method=METHOD))
    assert session.state is before
    session.restore(METHOD, region=((0, 60), (0, 70)))
    session.restore_into(tmp_path / "out.tif", METHOD)
    free.available = 2 * needed
    session.restore(METHOD)


def test_huge_stacks_are_not_touched_before_they_are_refused() -> None:
    def touched(*_: Any) -> None:
        raise AssertionError("read")

    huge = da.map_blocks(
        touched, chunks=((1,) * 5000, (40000,), (40000,)), dtype=np.uint16, meta=np.empty(0)
    )
    viewer = ViewerModel()
    layer = viewer.add_image(da.zeros((3, 40, 50), dtype=np.uint16))
    session = Session(viewer, layer)
    session.set_response(Gamma(1.8))
    session.set_psf(delta())
    source = session.source()[1]
    giant = type(source)(huge, False, None, "giant")
    with pytest.raises(CrfDeblurError, match=r"176000\.0 GB of memory"):
        memory.check_room(giant, giant.whole)


def test_parts_with_psfs_of_their_own_go_into_a_file(tmp_path: Path, blurred: Simulated) -> None:
    session = known(blurred.photo)
    psfs = np.stack([camera_shake(7, seed) for seed in (1, 2)])[None]
    statuses = ((PsfStatus.GOOD, PsfStatus.GOOD),)
    session.set_psf(line(7, 0.4), field=PsfField(psfs, statuses, blurred.photo.shape[:2]))
    layer = session.restore_into(tmp_path / "out.tif", METHOD)
    whole = session.restore(METHOD).data
    # Windows of a small photo are the same; what is measured on a sample is alike.
    assert np.abs(layer.data.compute().astype(float) - whole).mean() < 0.5


def test_a_file_that_is_no_tiff_or_zarr_is_refused(tmp_path: Path, blurred: Simulated) -> None:
    with pytest.raises(CrfDeblurError, match=r"\.zarr"):
        known(blurred.photo).restore_into(tmp_path / "out.png")
    assert not list(tmp_path.iterdir())


def test_a_volume_goes_into_a_file_too(tmp_path: Path) -> None:
    stack = np.random.default_rng(0).random((6, 40, 50)).astype(np.float32)
    session = known(da.from_array(stack, chunks=(1, 40, 50)))
    psf = np.random.default_rng(1).random((3, 7, 5))
    session.set_psf(psf)
    layer = session.restore_into(tmp_path / "out.zarr", RichardsonLucy(3))
    expected = restore_large(stack, Gamma(1.8), psf, RichardsonLucy(3), guard=True).compute()
    np.testing.assert_array_equal(layer.data.compute(), expected)


def test_the_button_asks_for_the_file(
    qtbot: QtBot, session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session.set_response(Gamma(1.8))
    session.set_psf(line(7, 0.4))
    dock = RestoreDock(session.viewer)
    dock._method.chosen = "Wiener"
    monkeypatch.setattr(restore, "ask_save", lambda *_: tmp_path / "out.tif")
    (button,) = [each for each in dock._buttons if each.text == "Restore into a file..."]
    button.changed.emit(True)
    assert dock.busy
    qtbot.waitUntil(lambda: dock.runner.idle, timeout=LONG)
    assert (tmp_path / "out.tif").exists()
    layer = session.viewer.layers["panels [deblurred]"]
    assert layer.data.shape == session.photo.data.shape
    session.flip()
    assert not layer.visible
