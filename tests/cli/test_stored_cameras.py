"""Stored cameras on the command line: a photo starts from the last ones, none counts twice."""

from argparse import Namespace
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from napari_crfdeblur.cli import main
from napari_crfdeblur.cli.stored import stored_camera
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import (
    Finding,
    GivenResponse,
    MaximumLikelihood,
    RankMinimization,
    ResponseStatus,
)
from napari_crfdeblur.io import (
    CameraKey,
    CameraRecord,
    CountedPhoto,
    StoredCamera,
    keep_estimate,
    read_camera,
    read_photo,
    read_responses,
    write_camera,
    write_psf,
)
from napari_crfdeblur.psf import camera_shake
from napari_crfdeblur.quality import response_error
from napari_crfdeblur.response import Cameras, GeneralizedGamma, around
from napari_crfdeblur.simulate import Camera, simulate, slanted_edges

RESPONSE = GeneralizedGamma((0.85, -0.75, 0.25))
KEY = CameraKey("FUJIFILM", "X100", "contrast hard, software Ver1.00")
LEVELS = np.linspace(0, 1, 33)


def save(path, pixels, model="X100", **tags):
    """A photo with the EXIF data of a camera."""
    exif = Image.Exif()
    if model:
        exif.update({0x010F: "FUJIFILM", 0x0110: model, 0x0131: tags.get("software", "Ver1.00")})
        exif.get_ifd(0x8769)[0xA408] = tags.get("contrast", 2)
    Image.fromarray(pixels).save(path, exif=exif)


def blurred(shape, seed):
    scene = slanted_edges(shape, seed=seed, pitch=70, channels=1)
    return simulate(scene, camera_shake(9, 4), Camera(RESPONSE, noise=0.002), seed=seed).photo


def run(*arguments):
    """What a run that goes well prints."""
    said = StringIO()
    with redirect_stdout(said):
        assert main([*map(str, arguments), "--blur-extent", "13"]) == 0
    return said.getvalue()


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """Photos of one camera, and what two runs with them stored and said."""
    folder = tmp_path_factory.mktemp("photos")
    photos = [blurred((90, 124), 1), blurred((146, 218), 3), blurred((100, 140), 8)]
    for name, photo in zip(("one.png", "two.png", "three.png"), photos, strict=True):
        save(folder / name, photo)
    save(folder / "copy.png", photos[0], software="Ver1.00")
    write_psf(folder / "psf.npy", camera_shake(9, 4))
    cameras = folder / "cameras"
    first = run("estimate", folder / "one.png", "--cameras", cameras)
    after_one = read_camera(cameras, KEY)
    names = [folder / name for name in ("copy.png", "two.png")]
    second = run("estimate", *names, "--cameras", cameras, "-o", folder / "two.json")
    return Namespace(
        folder=folder,
        cameras=cameras,
        said=(first, second),
        records=(after_one, read_camera(cameras, KEY)),
    )


def spread(prior):
    return float(np.mean(prior.deviation(LEVELS)))


def test_the_first_photo_starts_from_any_camera_and_is_stored(told):
    assert f"camera: {KEY}\n  nothing is stored of it yet\n" in told.said[0]
    assert f"stored of this camera: 1 photo now, in {told.cameras}" in told.said[0]
    assert [photo.name for photo in told.records[0].photos] == ["one.png"]
    assert spread(told.records[0].posterior) < spread(Cameras.DIGITAL.prior)


def test_the_next_photo_starts_from_what_is_stored_and_takes_its_place(told):
    assert "starting from its stored estimate, from 1 photo\n" in told.said[1]
    assert "stored of this camera: 2 photos now" in told.said[1]
    assert [photo.name for photo in told.records[1].photos] == ["one.png", "two.png"]
    assert spread(told.records[1].posterior) < spread(told.records[0].posterior)
    assert len(list(told.cameras.iterdir())) == 1
    (written,) = read_responses(told.folder / "two.json")
    stored = told.records[1].posterior.curve()
    # The posterior is kept at its own nodes, the file's curve between 257 intensities, with a
    # steady toe and shoulder, beyond what edges cover.
    assert response_error(written, stored, (0.2, 0.8)) < 1e-3


def test_the_same_picture_is_not_counted_twice_under_another_name(told):
    assert "copy.png: counted already, left out\n" in told.said[1]
    again = run("estimate", told.folder / "one.png", "--cameras", told.cameras)
    assert "one.png: counted already, so the stored estimate is used as it is\n" in again
    assert "stored of this camera: 2 photos, as before\n" in again
    assert read_camera(told.cameras, KEY).photos == told.records[1].photos


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("three.png", "starting from its stored estimate, from 2 photos\n"),
        ("one.png", "one.png: counted already, so the stored estimate is used as it is\n"),
    ],
)
def test_deblur_starts_from_what_is_stored_and_stores_nothing(told, name, sentence):
    before = {path: path.read_bytes() for path in told.cameras.iterdir()}
    given = ["--cameras", told.cameras, "--psf", told.folder / "psf.npy"]
    out = told.folder / "sharp.png"
    assert sentence in run("deblur", told.folder / name, *given, "-o", out)
    assert read_photo(out).shape == read_photo(told.folder / name).shape
    assert {path: path.read_bytes() for path in told.cameras.iterdir()} == before


def test_photos_that_say_nothing_are_kept_under_a_name(told, tmp_path):
    save(tmp_path / "scan.png", read_photo(told.folder / "one.png"), model="")
    said = run(
        "estimate", tmp_path / "scan.png", "--cameras", tmp_path, "--camera", " My  scanner "
    )
    assert "camera: My scanner\n" in said
    assert len(read_camera(tmp_path, CameraKey("", "My scanner")).photos) == 1


# From here on without any estimation.


def an_estimate(status=ResponseStatus.GOOD, *findings, posterior=True):
    plain = GivenResponse(RESPONSE).estimate()
    known = around(RESPONSE, 0.01) if posterior else None
    return replace(plain, status=status, findings=findings, posterior=known)


def a_camera(folder, *photos, record=None):
    return StoredCamera(folder, KEY, record, tuple(CountedPhoto(p, p * 2) for p in photos))


def a_record(*photos):
    return CameraRecord(KEY, around(RESPONSE, 0.1), tuple(CountedPhoto(p, p * 2) for p in photos))


@pytest.mark.parametrize("status", [ResponseStatus.GOOD, ResponseStatus.DOUBTFUL])
def test_an_estimate_with_its_own_doubts_is_kept(tmp_path, status):
    said = keep_estimate(a_camera(tmp_path, "a"), an_estimate(status, Finding.UNSURE))
    assert said.startswith("stored of this camera: 1 photo now, in ")
    assert read_camera(tmp_path, KEY).photos == (CountedPhoto("a", "aa"),)


@pytest.mark.parametrize(
    ("estimate", "reason"),
    [
        (an_estimate(ResponseStatus.CANNOT_TELL), "add too little"),
        (an_estimate(ResponseStatus.NOT_CONVERGED), "did not converge"),
        (an_estimate(ResponseStatus.DOUBTFUL, Finding.UNSURE, Finding.CONTRADICTION), "contradict"),
        (an_estimate(posterior=False), "nothing is known"),
    ],
)
@pytest.mark.parametrize("stored", [False, True])
def test_an_estimate_that_would_do_harm_is_not_kept(tmp_path, estimate, reason, stored):
    record = a_record("a") if stored else None
    if record:
        write_camera(tmp_path, record)
    before = [path.read_bytes() for path in tmp_path.iterdir()]
    said = keep_estimate(a_camera(tmp_path, "b", record=record), estimate)
    assert said.startswith("not stored: ")
    assert reason in said
    assert said.endswith(f"{'1 photo' if stored else 'nothing'}, as before")
    assert [path.read_bytes() for path in tmp_path.iterdir()] == before


def test_what_another_run_has_stored_meanwhile_is_not_undone(tmp_path):
    camera = a_camera(tmp_path, "b")
    write_camera(tmp_path, a_record("a"))
    with pytest.raises(CrfDeblurError, match="was changed while"):
        keep_estimate(camera, an_estimate())
    assert read_camera(tmp_path, KEY).photos == a_record("a").photos


def test_the_method_starts_from_what_is_stored(tmp_path):
    fit, record = MaximumLikelihood(Cameras.DORF, shift=0.2), a_record("a")
    assert a_camera(tmp_path, "a").method(fit) is fit
    started = a_camera(tmp_path, "b", record=record).method(fit)
    assert started.prior is record.posterior
    assert started.shift == 0.2
    assert isinstance(a_camera(tmp_path, "a", record=record).method(fit), GivenResponse)
    assert a_camera(tmp_path, "b", record=record).method(RankMinimization()) == RankMinimization()


def test_what_is_stored_is_shown_with_its_band(tmp_path):
    record = a_record("a")
    camera = a_camera(tmp_path, "a", record=record)
    (shown,) = camera.told((camera.method(MaximumLikelihood()).estimate(),))
    middle = shown.curve.to_irradiance(shown.intensity)
    assert np.all(shown.lower[1:-1] < middle[1:-1])
    assert np.all(shown.upper[1:-1] > middle[1:-1])
    # A band in irradiance, seen through the response, is that of the intensity to first order.
    seen = (shown.curve.to_intensity(shown.upper) - shown.curve.to_intensity(shown.lower)) / 2
    np.testing.assert_allclose(
        seen[64:192], 1.96 * record.posterior.deviation(middle)[64:192], rtol=0.1
    )
    assert shown.posterior is record.posterior


@pytest.mark.parametrize("status", ResponseStatus)
def test_what_is_stored_is_not_called_any_camera(tmp_path, status):
    found = an_estimate(status)
    assert a_camera(tmp_path, "a").verdict(found) == status.value
    said = a_camera(tmp_path, "b", record=a_record("a")).verdict(found)
    told = status in (ResponseStatus.GIVEN, ResponseStatus.CANNOT_TELL)
    assert ("stored estimate" in said) == told
    assert (said == status.value) != told


def ask(folder, *photos, camera=None):
    """The stored camera of photos, each a file's name with its EXIF data."""
    pixels = np.arange(12, dtype=np.uint8).reshape(3, 4)
    for number, (name, tags) in enumerate(photos):
        save(folder / name, pixels + np.uint8(number), **tags)
    paths = [folder / name for name, _ in photos]
    arguments = Namespace(cameras=folder, camera=camera)
    return stored_camera(arguments, paths, [read_photo(path) for path in paths])


def test_photos_are_told_apart_by_their_pixels(tmp_path):
    found = ask(tmp_path, ("a.png", {}), ("b.png", {}))
    assert found.key == KEY
    assert found.fresh == found.used == (0, 1)
    record = CameraRecord(KEY, around(RESPONSE), found.photos[1:])
    assert replace(found, record=record).fresh == (0,)
    twice = replace(found, photos=(*found.photos, found.photos[0]))
    assert twice.used == (0, 1)
    assert twice.sentences()[-1] == "a.png: counted already, left out"


@pytest.mark.parametrize(
    ("photos", "camera", "advice"),
    [
        ([("a.png", {}), ("b.png", {"model": "X200"})], None, "different cameras or settings"),
        ([("a.png", {}), ("b.png", {"contrast": 1})], None, "different cameras or settings"),
        ([("a.png", {}), ("b.png", {"model": "X200"})], "mine", "FUJIFILM X100; FUJIFILM X200"),
        ([("a.png", {"model": ""})], None, "a.png: does not say .* --camera NAME"),
        ([("a.png", {}), ("b.png", {"model": ""})], None, "b.png: does not say"),
        ([("a.png", {"software": "GIMP 2.10"})], None, "a.png: edited with GIMP 2.10, .*--camera"),
    ],
)
def test_photos_whose_camera_is_in_doubt_are_refused(tmp_path, photos, camera, advice):
    with pytest.raises(CrfDeblurError, match=advice):
        ask(tmp_path, *photos, camera=camera)


@pytest.mark.parametrize(
    "tags", [{}, {"model": ""}, {"contrast": 1}, {"software": "GIMP 2.10"}], ids=str
)
def test_a_name_stands_above_what_the_photos_say_of_their_style(tmp_path, tags):
    found = ask(tmp_path, ("a.png", {}), ("b.png", tags), camera="mine")
    assert found.key == CameraKey("", "mine")


@pytest.mark.parametrize(
    ("arguments", "advice"),
    [
        (["estimate", "one.png", "--camera", "mine"], "give --cameras FOLDER"),
        (["deblur", "one.png", "--camera", "mine"], "give --cameras FOLDER"),
        (["estimate", "one.png", "--cameras", "c", "--method", "rank"], "--method likelihood"),
        (["estimate", "one.png", "--cameras", "c", "--per-channel"], "leave out --per-channel"),
        (["psf", "one.png", "--cameras", "c", "--per-channel"], "leave out --per-channel"),
        (["deblur", "one.png", "--cameras", "c", "--response", "srgb"], "leave out --response"),
        (["deblur", "one.png", "--cameras", "missing"], "no such folder"),
        (["estimate", "one.png", "--cameras", "one.png"], "folder"),
        (["estimate", "one.png", "two.png", "--cameras", "c"], "different cameras"),
    ],
)
def test_what_makes_no_sense_with_stored_cameras_is_refused(
    tmp_path, monkeypatch, capsys, arguments, advice
):
    monkeypatch.chdir(tmp_path)
    for name, model in (("one.png", "X100"), ("two.png", "X200")):
        save(Path(name), np.arange(256, dtype=np.uint8).reshape(8, 32), model=model)
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert advice in error
    assert error.count("\n") == 1
    assert list(Path().rglob("*.json")) == []


def test_a_camera_without_a_name_is_not_understood(capsys):
    assert main(["estimate", "one.png", "--cameras", "c", "--camera", " "]) == 2
    assert "name of a camera" in capsys.readouterr().err
