"""The size of a PSF, found from the picture alone, and what is left out on the way."""

import numpy as np
import pytest
from scipy.signal import fftconvolve

from napari_crfdeblur._typing import FloatArray
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.progress import Job
from napari_crfdeblur.psf import Evidence, XuJia, camera_shake, disk, estimate_psf, line
from napari_crfdeblur.psf.blind.blurred import Blurred
from napari_crfdeblur.psf.blind.colors import channel_weights
from napari_crfdeblur.psf.blind.size import extent_of, finding_size, is_cut, odd_size
from napari_crfdeblur.quality import kernel_similarity


def scene(rows: int, columns: int) -> FloatArray:
    """Rectangles of any size and gray, one before the other."""
    random = np.random.default_rng(5)
    picture = np.full((rows, columns), 0.5)
    for _ in range(rows * columns // 700):
        top, left = random.integers(0, [rows, columns])
        height, width = random.integers(6, 50, 2)
        picture[top : top + height, left : left + width] = random.uniform(0.05, 0.95)
    return picture


def blurred(psf: FloatArray, rows: int = 220, columns: int = 260) -> FloatArray:
    sharp = scene(rows + psf.shape[0] - 1, columns + psf.shape[1] - 1)
    clean = fftconvolve(sharp, psf, mode="valid")
    noise = np.random.default_rng(1).normal(0, 0.003, clean.shape)
    return np.asarray(clean + noise, dtype=np.float32)


@pytest.mark.parametrize(
    "psf",
    [camera_shake(9, 3), camera_shake(27, 6), disk(5), line(33, 1.5)],
    ids=["shake 9", "shake 27", "disk 10", "line 33"],
)
def test_the_size_is_found_and_never_too_small(psf: FloatArray) -> None:
    found = estimate_psf(blurred(psf), XuJia())
    assert max(found.psf.shape) >= extent_of(psf)
    # twice too large does no harm, and centering can add to it
    assert max(found.psf.shape) <= 3 * extent_of(psf) + 4
    assert kernel_similarity(found.psf, psf) > 0.75


def test_only_as_large_as_the_picture_permits() -> None:
    photo = blurred(camera_shake(9, 3), 60, 140)
    assert max(estimate_psf(photo, XuJia()).psf.shape) <= 3 * 20
    with pytest.raises(CrfDeblurError, match="too small"):
        estimate_psf(photo[:8], XuJia())


def test_the_extent_is_what_holds_nearly_all() -> None:
    psf = np.zeros((15, 15))
    psf[7, 3:12] = 1
    assert extent_of(psf / psf.sum()) == 9
    psf[0, 0] = 0.01  # a speck
    assert extent_of(psf / psf.sum()) == 9


def test_a_psf_from_border_to_border_can_be_cut() -> None:
    psf = np.zeros((11, 11))
    psf[5] = 1 / 11
    assert is_cut(psf)
    assert not is_cut(np.pad(psf, 3))


@pytest.mark.parametrize(
    ("size", "largest", "expected"), [(9.2, 40, 11), (11, 40, 11), (90, 40, 39), (1, 40, 3)]
)
def test_sizes_are_odd_and_within_limits(size: float, largest: int, expected: int) -> None:
    assert odd_size(size, largest) == expected


def test_where_no_psf_is_found_the_largest_is_taken() -> None:
    def search(plane: Blurred, size: int) -> Job[FloatArray]:
        yield from ()
        raise CrfDeblurError(f"nothing of {size} pixels in {plane}")

    job = finding_size(lambda _: Blurred(np.zeros((80, 90), np.float32)), search, 45)
    with pytest.raises(StopIteration) as stopped:
        next(job)
    assert stopped.value.value == 45


def test_clipped_light_is_left_out() -> None:
    truth = camera_shake(11, 3)
    sharp = scene(230, 270)
    rng = np.random.default_rng(4)
    for row, column in rng.integers(20, 210, (12, 2)):
        sharp[row : row + 4, column : column + 4] = 9.0  # lamps
    photo = fftconvolve(sharp, truth, mode="valid")
    clipped = photo >= 1
    photo = np.asarray(np.clip(photo, 0, 1), dtype=np.float32)
    masked = estimate_psf(Evidence(photo, clipped), XuJia(size=13)).psf
    naive = estimate_psf(photo, XuJia(size=13)).psf
    assert kernel_similarity(masked, truth) > 0.8
    assert kernel_similarity(masked, truth) > kernel_similarity(naive, truth) - 0.02


def test_gradients_near_clipped_pixels_do_not_count() -> None:
    picture, clipped = scene(90, 110), np.zeros((90, 110), dtype=bool)
    clipped[40, 50] = True
    plane = Blurred.of(picture.astype(np.float32), clipped, 9)
    usable = plane.usable
    assert usable is not None
    assert not usable[36:45, 46:55].any()
    assert usable.sum() == 90 * 110 - 81
    assert not plane.gradient()[:, 36:45, 46:55].any()
    assert not plane.scaled(0.5).gradient()[:, 20, 25].any()


def test_text_on_clipped_white_keeps_what_there_is() -> None:
    picture = scene(90, 110).astype(np.float32)
    nearly_all = np.ones((90, 110), dtype=bool)
    nearly_all[::9, ::9] = False
    assert Blurred.of(picture, nearly_all, 9).usable is None


def test_a_mask_of_another_shape_is_refused() -> None:
    with pytest.raises(ValueError, match="clipped pixels of shape"):
        Evidence(scene(60, 70), np.zeros((60, 71), dtype=bool))


def test_edges_between_colors_of_one_brightness_count() -> None:
    truth = camera_shake(11, 3)
    tint = scene(200 + 10, 240 + 10) - 0.5
    sharp = 0.5 + tint[..., None] * np.array([0.9, -0.9, 0.0])
    photo = fftconvolve(sharp, truth[..., None], mode="valid", axes=(0, 1))
    photo += np.random.default_rng(1).normal(0, 0.003, photo.shape)
    photo = np.asarray(photo, dtype=np.float32)
    weights = channel_weights(photo)
    assert weights @ [1, -1, 0] == pytest.approx(np.sign(weights[0]), abs=0.02)  # noise
    assert kernel_similarity(estimate_psf(photo, XuJia(size=13)).psf, truth) > 0.8


def test_a_flat_or_narrow_photo_has_weights_too() -> None:
    for shape in ((9, 11, 3), (1, 5, 3), (4, 1, 3)):
        weights = channel_weights(np.full(shape, 0.4, dtype=np.float32))
        assert np.abs(weights).sum() == pytest.approx(1)
