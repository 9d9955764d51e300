"""Many photos: each is deblurred once, and none is lost for the sake of another."""

import errno
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from napari_crfdeblur.batch import Batch, Fate, PsfOf, deblur_files, deblurring_files
from napari_crfdeblur.batch import base as batch_base
from napari_crfdeblur.batch.base import UNFINISHED
from napari_crfdeblur.batch.shared import PSF, RESPONSE
from napari_crfdeblur.cli import main
from napari_crfdeblur.deconvolution import RichardsonLucy, Wiener
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import GivenResponse
from napari_crfdeblur.io import read_photo, read_psf, read_responses, write_photo, write_psf
from napari_crfdeblur.pipeline import DeblurOptions, deblur
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import GivenPsf, camera_shake
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import SRGB, Gamma
from napari_crfdeblur.simulate import Camera, simulate, slanted_edges

KERNEL = camera_shake(9, 3)
OPTIONS = DeblurOptions(GivenResponse(SRGB()), psf=GivenPsf(KERNEL), method=Wiener())


@pytest.fixture
def photos(tmp_path):
    paths = [tmp_path / f"{name}.png" for name in ("a", "b", "c")]
    for seed, path in enumerate(paths):
        values = np.random.default_rng(seed).integers(0, 255, (60, 70, 3))
        write_photo(path, values.astype(np.uint8))
    return paths


def fates(result):
    return [each.fate for each in result.outcomes]


def times(result):
    return [each.result.stat().st_mtime_ns for each in result.outcomes]


def test_each_photo_becomes_what_it_becomes_alone(photos, tmp_path):
    result = deblur_files(Batch(photos, tmp_path / "out", OPTIONS))
    assert fates(result) == [Fate.DONE] * 3
    assert result.sentence == "deblurred 3 of 3"
    for photo, outcome in zip(photos, result.outcomes, strict=True):
        assert outcome.result == tmp_path / "out" / f"{photo.stem}-deblurred.png"
        expected = deblur(read_photo(photo), OPTIONS).photo
        np.testing.assert_array_equal(read_photo(outcome.result), expected)


def test_what_is_done_is_not_done_again(photos, tmp_path):
    batch = Batch(photos, tmp_path / "out", OPTIONS)
    before = times(deblur_files(batch))
    again = deblur_files(batch)
    assert fates(again) == [Fate.KEPT] * 3
    assert times(again) == before
    assert again.sentence == "deblurred 0 of 3, 3 done before"


def test_other_settings_make_all_anew_under_the_same_names(photos, tmp_path):
    first = deblur_files(Batch(photos, tmp_path / "out", OPTIONS))
    other = DeblurOptions(GivenResponse(Gamma(1.8)), psf=OPTIONS.psf, method=OPTIONS.method)
    second = deblur_files(Batch(photos, tmp_path / "out", other))
    assert fates(second) == [Fate.DONE] * 3
    assert [e.result for e in second.outcomes] == [e.result for e in first.outcomes]
    expected = deblur(read_photo(photos[1]), other).photo
    np.testing.assert_array_equal(read_photo(second.outcomes[1].result), expected)


def test_a_photo_that_changed_is_done_again_and_no_other(photos, tmp_path):
    batch = Batch(photos, tmp_path / "out", OPTIONS)
    deblur_files(batch)
    write_photo(photos[1], read_photo(photos[1])[::-1])
    again = deblur_files(batch)
    assert fates(again) == [Fate.KEPT, Fate.DONE, Fate.KEPT]
    expected = deblur(read_photo(photos[1]), OPTIONS).photo
    np.testing.assert_array_equal(read_photo(again.outcomes[1].result), expected)


def test_a_bad_photo_is_passed_over_with_its_reason(photos, tmp_path):
    (tmp_path / "text.png").write_text("no picture")
    write_photo(tmp_path / "flat.png", np.full((60, 70), 9, np.uint8))
    write_photo(tmp_path / "tiny.png", np.arange(81, dtype=np.uint8).reshape(9, 9)[:8])
    bad = [tmp_path / name for name in ("text.png", "flat.png", "tiny.png", "none.png")]
    result = deblur_files(Batch([bad[0], *photos, *bad[1:]], tmp_path / "out", OPTIONS))
    failed = {each.photo.name: each.reason for each in result.of(Fate.FAILED)}
    reasons = ["not a PNG", "is constant", "is larger than the image", "there is no such file"]
    assert list(failed) == [path.name for path in bad]
    for reason, found in zip(reasons, failed.values(), strict=True):
        assert reason in found
    assert len(result.of(Fate.DONE)) == 3
    assert result.sentence == "deblurred 3 of 7, 4 passed over"


def test_same_names_in_different_folders_are_kept_apart(photos, tmp_path):
    (tmp_path / "more").mkdir()
    other = tmp_path / "more" / "a.png"
    write_photo(other, read_photo(photos[2]))
    deblur_files(Batch(photos[:1], tmp_path / "out", OPTIONS))
    result = deblur_files(Batch([other, photos[0], other], tmp_path / "out", OPTIONS))
    names = [each.result.name for each in result.outcomes]
    assert names == ["a-deblurred-2.png", "a-deblurred.png"]
    assert fates(result) == [Fate.DONE, Fate.KEPT]


def test_the_photos_themselves_are_never_overwritten(photos):
    before = [path.read_bytes() for path in photos]
    result = deblur_files(Batch(photos, photos[0].parent, OPTIONS, suffix=""))
    assert [path.read_bytes() for path in photos] == before
    assert [each.result.name for each in result.outcomes] == ["a-2.png", "b-2.png", "c-2.png"]


def test_a_full_disk_is_a_reason_and_leaves_nothing_half_written(photos, tmp_path, monkeypatch):
    written = []

    def full(path, *_arguments, **_options):
        written.append(path)
        if len(written) == 2:
            path.write_bytes(b"half")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write_photo(path, *_arguments, **_options)

    monkeypatch.setattr(batch_base, "write_photo", full)
    result = deblur_files(Batch(photos, tmp_path / "out", OPTIONS))
    assert fates(result) == [Fate.DONE, Fate.FAILED, Fate.DONE]
    assert "No space left" in result.outcomes[1].reason
    found = {path.name for path in (tmp_path / "out").iterdir()}
    assert found == {"a-deblurred.png", "c-deblurred.png", "crfdeblur-batch.jsonl"}


def test_a_stopped_batch_goes_on_where_it_stopped(photos, tmp_path):
    batch = Batch(photos, tmp_path / "out", OPTIONS)
    job = deblurring_files(batch)
    while "b.png" not in next(job).stage:
        pass
    job.close()
    assert not (tmp_path / "out" / UNFINISHED).exists()
    assert fates(deblur_files(batch)) == [Fate.KEPT, Fate.DONE, Fate.DONE]


KILLED = """
import os, signal, sys
from napari_crfdeblur.batch import base
from napari_crfdeblur.cli import main

write, written = base.write_photo, []

def dying(path, photo, **options):
    written.append(path)
    if len(written) == 4:
        path.write_bytes(b"half")
        os.kill(os.getpid(), signal.SIGKILL)
    write(path, photo, **options)

base.write_photo = dying
main(sys.argv[1:])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no such signal there")
def test_a_killed_batch_leaves_whole_files_and_goes_on(tmp_path, monkeypatch):
    paths = [tmp_path / f"{number:02}.png" for number in range(6)]
    for seed, path in enumerate(paths):
        values = np.random.default_rng(seed).integers(0, 255, (60, 80, 3))
        write_photo(path, values.astype(np.uint8))
    write_psf(tmp_path / "psf.npy", KERNEL)
    options = ["--response", "srgb", "--psf", "psf.npy", "--method", "wiener", "-o", "out"]
    arguments = ["batch", *options, *(path.name for path in paths)]
    killed = subprocess.run([sys.executable, "-c", KILLED, *arguments], cwd=tmp_path)
    assert killed.returncode == -signal.SIGKILL
    out = tmp_path / "out"
    before = {path: path.stat().st_mtime_ns for path in out.glob("*.png")}
    assert len(before) == 3
    assert (out / UNFINISHED).exists()
    for path in before:
        assert read_photo(path).shape == (60, 80, 3)
    changed = read_photo(paths[0])[::-1]
    write_photo(paths[0], changed)
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 0
    after = {path: path.stat().st_mtime_ns for path in out.glob("*.png")}
    assert len(after) == len(paths)
    kept = [path for path, moment in before.items() if after[path] == moment]
    assert {path.name for path in kept} == {"01-deblurred.png", "02-deblurred.png"}
    assert not (out / UNFINISHED).exists()
    options = DeblurOptions(GivenResponse(SRGB()), psf=GivenPsf(KERNEL), method=Wiener())
    expected = deblur(changed, options).photo
    np.testing.assert_array_equal(read_photo(out / "00-deblurred.png"), expected)


@pytest.fixture(scope="module")
def taken():
    """Photos of one camera and one shake, of different scenes."""
    scenes = [slanted_edges((208, 258), seed=seed, pitch=90) for seed in (1, 2)]
    return [
        simulate(scene, KERNEL, Camera(Gamma(1.6), noise=0.002), seed=5).photo for scene in scenes
    ]


def test_one_response_is_found_from_all_photos_and_found_again(taken, tmp_path):
    paths = [tmp_path / "a.png", tmp_path / "b.png"]
    for path, photo in zip(paths, taken, strict=True):
        write_photo(path, photo)
    (tmp_path / "bad.png").write_text("no picture")
    options = DeblurOptions(psf=GivenPsf(KERNEL), method=RichardsonLucy(2), blur_extent=11)
    batch = Batch([*paths, tmp_path / "bad.png"], tmp_path / "out", options)
    result = deblur_files(batch)
    assert fates(result) == [Fate.DONE, Fate.DONE, Fate.FAILED]
    (estimate,) = result.responses
    (curve,) = read_responses(tmp_path / "out" / RESPONSE)
    levels = np.linspace(0, 1, 9)
    np.testing.assert_allclose(
        curve.to_irradiance(levels), estimate.curve.to_irradiance(levels), atol=1e-3
    )
    known = DeblurOptions(GivenResponse(curve), psf=options.psf, method=options.method)
    expected = deblur(taken[1], known).photo
    np.testing.assert_array_equal(read_photo(result.outcomes[1].result), expected)
    again = deblur_files(batch)
    assert again.responses == ()
    assert fates(again) == [Fate.KEPT, Fate.KEPT, Fate.FAILED]
    fewer = deblur_files(Batch(paths[:1], tmp_path / "out", options))
    assert fates(fewer) == [Fate.KEPT]


@pytest.mark.parametrize("psf_of", [PsfOf.FIRST, PsfOf.ONE])
def test_one_psf_is_found_for_all_photos(taken, tmp_path, psf_of):
    paths = [tmp_path / "a.png", tmp_path / "b.png"]
    for path, photo in zip(paths, taken, strict=True):
        write_photo(path, photo)
    options = DeblurOptions(GivenResponse(Gamma(1.6)), blur_extent=11, method=Wiener())
    result = deblur_files(Batch(paths, tmp_path / "out", options, psf_of))
    found = read_psf(tmp_path / "out" / PSF)
    assert kernel_similarity(found, KERNEL) > 0.7
    known = DeblurOptions(options.response, psf=GivenPsf(found), blur_extent=11, method=Wiener())
    for photo, outcome in zip(taken, result.outcomes, strict=True):
        np.testing.assert_array_equal(read_photo(outcome.result), deblur(photo, known).photo)
    assert fates(deblur_files(Batch(paths, tmp_path / "out", options, psf_of))) == [Fate.KEPT] * 2


def test_photos_that_tell_nothing_at_all_stop_the_batch(tmp_path):
    (tmp_path / "bad.png").write_text("no picture")
    with pytest.raises(CrfDeblurError, match="none of the photos can be read"):
        deblur_files(Batch([tmp_path / "bad.png"], tmp_path / "out"))


def test_wrong_arguments_are_refused(photos, tmp_path):
    with pytest.raises(CrfDeblurError, match="no file is chosen"):
        Batch([], tmp_path)
    with pytest.raises(CrfDeblurError, match="part of the name"):
        Batch(photos, tmp_path, suffix="/x")


def test_a_batch_waits_until_a_cancelled_one_in_its_folder_has_ended(photos, tmp_path):
    batch = Batch(photos, tmp_path / "out", OPTIONS)
    cancelled, following = deblurring_files(batch), deblurring_files(batch)
    reports = [next(cancelled) for _ in range(3)]
    waiting = next(following)
    assert waiting.stage == "waiting for another batch in this folder"
    assert all(report.stage != waiting.stage for report in reports)
    cancelled.close()
    assert fates(drain(following)) == [Fate.DONE] * 3
