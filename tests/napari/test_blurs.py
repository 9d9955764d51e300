"""The blur on layers: saturated lamps, PSFs of three dimensions, and those of all parts."""

import json
from dataclasses import replace

import numpy as np
import pytest
from napari.components import ViewerModel
from scipy.signal import fftconvolve

from napari_crfdeblur import CrfDeblurError, DeblurOptions, Session, deblur
from napari_crfdeblur._napari.session.restore import within
from napari_crfdeblur._napari.session.step import Level
from napari_crfdeblur._napari.session.way import way_of
from napari_crfdeblur._typing import FloatArray, Image
from napari_crfdeblur.deconvolution import (
    HyperLaplacian,
    RichardsonLucy,
    Wiener,
    deconvolve,
    guard,
)
from napari_crfdeblur.deconvolution.varying import deconvolve_varying
from napari_crfdeblur.estimate import GivenResponse, given_responses
from napari_crfdeblur.pipeline.blur import part_of
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import GivenPsf, Poses, PsfField, PsfStatus, XuJia, disk, line
from napari_crfdeblur.response import Gamma, Identity, clipped_light
from napari_crfdeblur.simulate import CameraMotion, Simulated

KEY = "napari-crfdeblur"
SIDES = 84, 110
METHOD = HyperLaplacian(model_error=0.005)


def session_on(pixels: Image, **options: float) -> Session:
    viewer = ViewerModel()
    rgb = pixels.shape[-1] == 3
    return Session(viewer, viewer.add_image(pixels, name="photo", rgb=rgb), **options)


def panels(shape: tuple[int, int], seed: int) -> FloatArray:
    """Even panels of light from 0.05 to 0.6."""
    random = np.random.default_rng(seed)
    coarse = random.uniform(0.05, 0.6, [-(-side // 12) for side in shape])
    return np.kron(coarse, np.ones((12, 12)))[: shape[0], : shape[1]]


# --- saturated lamps


@pytest.fixture(scope="module")
def lamps() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sharp light without lamps, the recorded light with lamps, and their PSF."""
    psf = line(9, 0.4)
    reach = [side // 2 for side in psf.shape]
    scene = panels((SIDES[0] + 2 * reach[0], SIDES[1] + 2 * reach[1]), seed=4)
    lit = scene.copy()
    for row, column in ((30, 40), (60, 85), (48, 20)):
        lit[row : row + 3, column : column + 3] = 12.0
    noise = np.random.default_rng(5).normal(0, 1e-3, SIDES)
    recorded = np.clip(fftconvolve(lit, psf, mode="valid") + noise, 0, 1)
    inner = tuple(slice(own, -own) for own in reach)
    return scene[inner], recorded, psf


def ringing(found: FloatArray, lamps: tuple[FloatArray, FloatArray, FloatArray]) -> float:
    """Rms error of the light where nothing is saturated, and no lamp is."""
    scene, recorded, _ = lamps
    lit = fftconvolve((recorded >= 1).astype(float), np.ones((7, 13)), mode="same") > 0.5
    inside = np.zeros(SIDES, dtype=bool)
    inside[8:-8, 8:-8] = True
    return float(np.sqrt(np.mean((found - scene)[inside & ~lit] ** 2)))


@pytest.mark.parametrize(("full", "white"), [(65535, None), (1023, 1023.0)], ids=["16", "10 bits"])
def test_saturated_lamps_ring_less_and_the_white_level_says_which_are(
    lamps: tuple[FloatArray, FloatArray, FloatArray], full: int, white: float | None
) -> None:
    _, recorded, psf = lamps
    pixels = np.rint(recorded * full).astype(np.uint16)
    session = session_on(pixels, **({} if white is None else {"white": white}))
    session.set_response(Identity())
    session.set_psf(psf)
    layer = session.restore(METHOD)
    whole = ringing(session.state.sharp.layer.data, lamps)
    light = (pixels / full).astype(np.float32)
    without = ringing(deconvolve(light, psf, METHOD), lamps)
    assert whole < 0.5 * without
    # In three steps, the same.
    session.linearize()
    session.deconvolve(METHOD)
    np.testing.assert_array_equal(session.reapply().data, layer.data)
    assert session.state.restored.metadata[KEY]["psf"] == psf.tolist()


def test_a_white_level_that_is_never_reached_saturates_nothing(
    lamps: tuple[FloatArray, FloatArray, FloatArray],
) -> None:
    _, recorded, psf = lamps
    session = session_on(np.rint(recorded * 1023).astype(np.uint16), white=2046.0)
    session.set_response(Identity())
    session.set_psf(psf)
    session.restore(METHOD)
    linear = session.state.linear.layer.data
    expected = guard(linear, deconvolve(linear, psf, METHOD), psf.shape).sharp
    np.testing.assert_array_equal(session.state.sharp.layer.data, expected)


def test_colors_saturate_one_by_one_as_in_the_library(
    lamps: tuple[FloatArray, FloatArray, FloatArray],
) -> None:
    _, recorded, psf = lamps
    colors = np.stack([recorded, 0.8 * recorded, recorded[::-1]], axis=-1)
    photo = np.rint(colors * 255).astype(np.uint8)
    session = session_on(photo)
    options = DeblurOptions(GivenResponse(Gamma(1.8)), psf=GivenPsf(psf), method=METHOD)
    np.testing.assert_array_equal(session.deblur(options).data, deblur(photo, options).photo)


def test_the_preview_knows_what_is_saturated(
    lamps: tuple[FloatArray, FloatArray, FloatArray],
) -> None:
    _, recorded, psf = lamps
    session = session_on(recorded.astype(np.float32))
    session.set_response(Identity())
    session.set_psf(psf)
    photo = session.restore(METHOD).data
    np.testing.assert_array_equal(session.preview(METHOD).data, photo)  # all of it is seen


# --- a PSF for each part


@pytest.fixture(scope="module")
def turning() -> PsfField:
    """A camera that moved and turned, known."""
    times = np.zeros((3, 7, 7))
    times[[0, 1, 2], [2, 3, 4], [3, 3, 3]] = 0.25, 0.5, 0.25
    poses = Poses(np.array([-0.02, 0.0, 0.02]), times)
    centers = [[poses.psf_at((r, c)) for c in (-70.0, 0.0, 70.0)] for r in (-37.5, 37.5)]
    statuses = ((PsfStatus.GOOD, PsfStatus.GOOD, PsfStatus.BORROWED), (PsfStatus.GOOD,) * 3)
    return PsfField(np.array(centers), statuses, (150, 210), poses, {"turn": 0.8})


def test_a_part_has_the_psfs_of_its_place(turning: PsfField) -> None:
    part = part_of(turning, (slice(50, 90), slice(15, 65)))
    assert isinstance(part, PsfField)
    assert part.shape == (40, 50)
    np.testing.assert_array_equal(part.at(3.0, 35.5), turning.at(53.0, 50.5))
    assert part.pace == turning.pace


def test_the_photo_is_restored_with_the_psfs_of_its_parts(
    session: Session, turning: PsfField, blurred: Simulated
) -> None:
    session.set_response(Gamma(1.8))
    session.set_psf(turning.at(74.5, 104.5), field=turning)
    session.restore(Wiener())
    options = DeblurOptions(GivenResponse(Gamma(1.8)), psf=GivenPsf(disk(2)), method=Wiener())
    linear = deblur(blurred.photo, options).linear
    sharp, clipped = session.state.sharp.layer.data, clipped_light(blurred.photo)
    free = deconvolve_varying(linear, turning, Wiener(), clipped=clipped)
    expected = guard(linear, free, turning.psfs.shape[2:], clipped=clipped).sharp
    np.testing.assert_array_equal(sharp, expected)
    single = deconvolve(linear, turning.at(74.5, 104.5), Wiener())
    assert np.abs(sharp - single).max() > 0.01


def test_the_preview_has_the_psfs_of_what_is_seen(session: Session, turning: PsfField) -> None:
    session.set_response(Gamma(1.8))
    session.set_psf(turning.at(74.5, 104.5), field=turning)
    whole = session.restore(Wiener(weight=0.01)).data.astype(float)
    _, source = session.source()
    region, response = (slice(10, 75), slice(115, 200)), given_responses(Gamma(1.8))
    options = DeblurOptions(method=Wiener(weight=0.01))
    seen = drain(within(source, region, response, turning, options))
    middle = turning.at(74.5, 104.5)
    other = drain(within(source, region, response, middle, options))
    error, without = (np.abs(x - whole[region]).mean() for x in (seen, other))
    # the guard judges what is seen alone
    assert error < 0.6 * without


def test_the_map_is_shown_kept_written_and_repeated(
    session: Session, turning: PsfField, blurred: Simulated
) -> None:
    session.set_response(Gamma(1.8))
    session.set_psf(disk(3))
    layer = session.viewer.layers["panels [PSF]"]
    session.set_psf(turning.at(74.5, 104.5), field=turning)
    np.testing.assert_allclose(layer.data, turning.picture(), atol=1e-7)
    assert session.viewer.layers["panels [PSF]"] is layer
    record = json.loads(json.dumps(layer.metadata[KEY]))
    assert "parts=PsfField(" in session.script()
    assert "from napari_crfdeblur.psf import GivenPsf, Poses, PsfField" in session.script()
    other = session_on(blurred.photo)
    other.repeat(record)
    np.testing.assert_array_equal(other.state.field.psfs, turning.psfs)
    assert other.state.field.statuses == turning.statuses
    other.set_psf(disk(3))  # takes the place of all of them
    assert other.state.field is None
    assert other.record()["psf_field"] is None


def test_the_psfs_of_parts_are_estimated_and_said(blurred: Simulated) -> None:
    session, said = session_on(blurred.photo), []
    session.said.connect(said.append)
    session.set_response(Gamma(1.8))
    found = session.estimate_psf(XuJia(7), regions=(1, 2))
    assert session.state.psf is found
    assert session.state.field.grid == (1, 2)
    assert session.state.field.shape == (150, 210)
    assert "PSFs of parts: 2 of 2 clearly determined" in said[-1].text
    assert said[-1].level is Level.INFO
    options = way_of(session.state).options
    assert (options.psf, options.regions) == (XuJia(7), (1, 2))
    assert "psf=XuJia(size=7)" in session.script()
    assert "regions=(1, 2)" in session.script()


def test_most_parts_in_doubt_are_a_doubt(session: Session, turning: PsfField) -> None:
    said = []
    session.said.connect(said.append)
    bad = PsfStatus.DOUBTFUL
    doubtful = replace(turning, statuses=((bad, bad, PsfStatus.BORROWED), (bad, bad, bad)))
    session.say_trust(parts=doubtful)
    text = "0 of 6 clearly determined, 5 uncertain, 1 follow from the others; the camera turned"
    assert text in said[-1].text
    assert said[-1].level is Level.DOUBT


def test_all_in_one_divides_the_photo_too(blurred: Simulated) -> None:
    session = session_on(blurred.photo)
    options = DeblurOptions(
        GivenResponse(Gamma(1.8)), psf=XuJia(7), method=Wiener(), regions=(1, 2)
    )
    layer = session.deblur(options)
    np.testing.assert_array_equal(layer.data, deblur(blurred.photo, options).photo)
    assert session.state.record.options.regions == (1, 2)
    np.testing.assert_allclose(
        session.viewer.layers["photo [PSF]"].data, session.state.field.picture(), atol=1e-7
    )


def test_parts_are_those_of_the_whole_picture(session: Session, turning: PsfField) -> None:
    session.set_response(Gamma(1.8))
    before = session.state
    with pytest.raises(CrfDeblurError, match="leave out the region"):
        session.estimate_psf(region=((0, 100), (0, 210)), regions=2)
    with pytest.raises(CrfDeblurError, match="210 x 150 pixels, but “photo” has 60 x 50"):
        session_on(np.ones((50, 60), np.uint8)).set_psf(disk(2), field=turning)
    assert session.state is before


def test_other_photos_get_the_psfs_of_parts_if_they_fit(
    session: Session, turning: PsfField, blurred: Simulated, tmp_path
) -> None:
    session.set_response(Gamma(1.8))
    session.set_psf(disk(3), field=turning)
    expected = session.restore(Wiener()).data
    same = session.viewer.add_image(blurred.photo, name="same")
    small = session.viewer.add_image(blurred.photo[:100], name="small")
    result = session.restore_layers([same, small], Wiener())
    np.testing.assert_array_equal(result.done["same"].data, expected)
    assert "210 x 150 pixels, but “small” has 210 x 100" in result.failed["small"]
    with pytest.raises(CrfDeblurError, match="one PSF of rows and columns"):
        session.restore_files([tmp_path / "a.png"], tmp_path)


def test_every_slice_of_a_stack_gets_the_psfs_of_its_parts(
    turning: PsfField, blurred: Simulated
) -> None:
    green = blurred.photo[..., 1]
    session = session_on(np.stack([green, green[::-1]]))
    session.set_response(Gamma(1.8))
    session.set_psf(turning.at(74.5, 104.5), field=turning)
    session.restore(Wiener())
    light, sharp = session.state.linear.layer.data, session.state.sharp.layer.data
    for own, found in zip(light, sharp, strict=True):
        free = deconvolve_varying(own, turning, Wiener())
        expected = guard(own, free, turning.psfs.shape[2:]).sharp
        np.testing.assert_array_equal(found, expected)
    layer = session.viewer.layers["photo [PSF]"]
    assert layer.ndim == 2  # seen on all slices
    session.viewer.dims.set_current_step(0, 1)
    session.estimate_psf(XuJia(7), region=((1, 2), (0, 150), (0, 210)), regions=(1, 2))
    assert session.state.sought.plane == (slice(1, 2), slice(0, 150), slice(0, 210))


def test_a_known_motion_varies_as_the_psfs_say(turning: PsfField) -> None:
    """The parts of a camera's own motion: what is shown in a corner is what it did there."""
    motion = CameraMotion(np.zeros((3, 2)), np.array([-0.02, 0.0, 0.02]))
    corner = motion.psf_at((100.0, 150.0))
    times = np.zeros((3, 9, 9))
    times[:, 4, 4] = 1 / 3
    poses = Poses(np.array([-0.02, 0.0, 0.02]), times)
    field = replace(turning, shape=(300, 420), poses=poses)
    part = part_of(field, (slice(200, 300), slice(300, 420)))
    found = part.at(149.5 + 100 - 200, 209.5 + 150 - 300)
    rows, columns = ((9 - side) // 2 for side in corner.shape)
    np.testing.assert_allclose(found[rows : 9 - rows, columns : 9 - columns], corner, atol=0.02)


# --- volumes


@pytest.fixture(scope="module")
def volume() -> tuple[FloatArray, FloatArray]:
    """A blurred stack of points and panels, shape (14, 40, 52), and its PSF (3, 7, 5)."""
    random = np.random.default_rng(8)
    psf = random.random((3, 7, 5)) ** 3
    psf /= psf.sum()
    scene = np.zeros((16, 46, 56))
    scene[random.random(scene.shape) < 0.003] = 8.0
    blurry = fftconvolve(scene + 0.1, psf, mode="valid")
    return np.clip(blurry / blurry.max(), 0, 1).astype(np.float32), psf


def test_a_stack_is_restored_as_a_volume(volume: tuple[FloatArray, FloatArray]) -> None:
    stack, psf = volume
    session = session_on(stack)
    session.set_response(Identity())
    session.set_psf(psf)
    session.restore(RichardsonLucy(5))
    light = session.state.linear.layer.data
    expected = deconvolve(light, psf, RichardsonLucy(5), clipped=light >= 0.988)
    np.testing.assert_array_equal(session.state.sharp.layer.data, expected)
    shown = session.viewer.layers["photo [PSF]"]
    np.testing.assert_allclose(shown.data, psf, atol=1e-7)
    assert session.state.restored.metadata[KEY]["psf"] == psf.tolist()
    slices = session.set_psf(psf.sum(axis=0))  # one by one again
    session.restore(RichardsonLucy(5))
    first = deconvolve(light[0], slices.psf, RichardsonLucy(5))
    np.testing.assert_allclose(session.state.sharp.layer.data[0], first, atol=1e-6)
    assert session.viewer.layers["photo [PSF]"].ndim == 2


def test_each_volume_of_a_series_is_its_own(volume: tuple[FloatArray, FloatArray]) -> None:
    stack, psf = volume
    series = np.stack([stack, stack[:, ::-1]])
    session = session_on(series)
    session.photo.scale = (1, 4, 2, 2)
    stages = []
    session.progressed.connect(lambda progress: stages.append(progress.stage))
    session.set_response(Identity())
    session.set_psf(psf)
    session.restore(Wiener())
    alone = session_on(series[1])
    alone.set_response(Identity())
    alone.set_psf(psf)
    np.testing.assert_array_equal(session.state.restored.data[1], alone.restore(Wiener()).data)
    assert any(stage.endswith("volume 2 of 2") for stage in stages)
    shown = session.viewer.layers["photo [PSF]"]
    np.testing.assert_array_equal(shown.scale, (4, 2, 2))


def test_the_preview_of_a_slice_takes_its_neighbors(
    volume: tuple[FloatArray, FloatArray],
) -> None:
    stack, psf = volume
    session = session_on(stack)
    session.set_response(Identity())
    session.set_psf(psf)
    whole = session.restore(Wiener(weight=0.01)).data
    for z in (0, 7):
        session.viewer.dims.set_current_step(0, z)
        seen = session.preview(Wiener(weight=0.01)).data
        assert seen.shape == (1, 40, 52)
        # Slices farther away tell a little, too.
        assert np.abs(seen[0] - whole[z]).mean() < 0.2 * np.abs(whole[z] - stack[z]).mean()


def test_a_psf_of_three_dimensions_needs_as_many_slices(
    volume: tuple[FloatArray, FloatArray], tmp_path
) -> None:
    stack, psf = volume
    flat = session_on(stack[0])
    with pytest.raises(CrfDeblurError, match="5 x 7 x 3, but “photo” is a single picture"):
        flat.set_psf(psf)
    assert flat.state.psf is None
    session = session_on(stack[:2])
    session.set_response(Identity())
    session.set_psf(psf)
    with pytest.raises(CrfDeblurError, match="reaches over 3 slices, of which there are 2"):
        session.restore()
    with pytest.raises(CrfDeblurError, match="one PSF of rows and columns"):
        session.restore_files([tmp_path / "a.png"], tmp_path)
    other = session.viewer.add_image(stack[0], name="flat")
    assert "is a single picture" in session.restore_layers([other]).failed["flat"]


def test_a_stack_of_pictures_becomes_the_psf_of_volumes(
    volume: tuple[FloatArray, FloatArray],
) -> None:
    stack, psf = volume
    session = session_on(stack)
    bead = session.viewer.add_image(psf, name="bead")
    np.testing.assert_allclose(session.use_psf_of(bead).psf, psf, atol=1e-15)
    series = session.viewer.add_image(np.stack([psf, psf]), name="two")
    with pytest.raises(CrfDeblurError, match="a PSF is a picture, or one stack of them"):
        session.use_psf_of(series)
