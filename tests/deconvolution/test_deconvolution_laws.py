"""What every method of deconvolution must do, on scenes with a known truth."""

from collections.abc import Callable
from dataclasses import FrozenInstanceError, fields
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import fft
from scipy.signal import fftconvolve

from napari_crfdeblur.deconvolution import (
    Deconvolver,
    HyperLaplacian,
    LocalShrinkage,
    PlaneStatistics,
    RichardsonLucy,
    SparseIrls,
    TotalVariation,
    Wiener,
    deconvolve,
    deconvolving,
    measure,
)
from napari_crfdeblur.progress import Progress, drain

METHODS: list[Deconvolver] = [
    Wiener(),
    RichardsonLucy(),
    SparseIrls(),
    HyperLaplacian(),
    LocalShrinkage(),
    TotalVariation(),
]
# whose prior is on differences
LINEAR_MODELS = [Wiener(), SparseIrls(), HyperLaplacian(), LocalShrinkage(), TotalVariation()]
NEARLY_FREE = [
    Wiener(1e-8),
    RichardsonLucy(),
    SparseIrls(1e-8),
    HyperLaplacian(1e-8, stages=8),
    LocalShrinkage(1e-8),
    TotalVariation(1e-8),
]

every_method = pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)


def leaves(shape: tuple[int, int], seed: int) -> NDArray[np.float64]:
    """Overlapping disks and bars of random brightness: sharp edges at every scale."""
    rng = np.random.default_rng(seed)
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    scene = np.full(shape, 0.5)
    for _ in range(150):
        row, column = rng.uniform(0, shape[0]), rng.uniform(0, shape[1])
        height, width = rng.uniform(3, 25, 2)
        y, x = (rows - row) / height, (columns - column) / width
        inside = y**2 + x**2 < 1 if rng.random() < 0.5 else np.maximum(abs(y), abs(x)) < 1
        scene[inside] = rng.uniform(0.1, 0.9)
    return scene


def shake(height: int = 11, width: int = 9) -> NDArray[np.float64]:
    """A hook: asymmetric under both flips, its transpose and its half turn."""
    psf = np.zeros((height, width))
    psf[1 : height - 1, 2] = np.linspace(0.3, 1, height - 2)
    psf[height - 2, 2 : width - 1] = np.linspace(1, 2, width - 3)
    return psf / psf.sum()


def photograph(
    scene: NDArray[np.float64], psf: NDArray[np.float64], noise: float = 0.005
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Sharp and blurred picture of the part of a scene for which all light is known."""
    blurred = fftconvolve(scene, psf, mode="valid")
    # scipy's 'valid' starts where the PSF's last pixel meets the scene's first
    top, left = ((side - 1) - side // 2 for side in psf.shape)
    sharp = scene[top : top + blurred.shape[0], left : left + blurred.shape[1]]
    blurred += np.random.default_rng(1).normal(0, noise, blurred.shape)
    return sharp.astype(np.float32), blurred.astype(np.float32)


def decibels(truth: NDArray[np.floating], picture: NDArray[np.floating]) -> float:
    return float(-10 * np.log10(np.mean((truth.astype(float) - picture) ** 2)))


@pytest.fixture(scope="module")
def case() -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64]]:
    psf = shake()
    return *photograph(leaves((140, 170), 3), psf), psf


Restored = Callable[..., NDArray[np.floating]]


@pytest.fixture(scope="module")
def restored_by(case) -> Restored:
    """The picture of the case as each method restores it, once."""

    def restored(method, dtype=np.float32):
        found = deconvolve(case[1].astype(dtype), case[2], method)
        found.setflags(write=False)
        return found

    return cache(restored)


@every_method
def test_deconvolution_sharpens(method, case, restored_by):
    sharp, blurred, _ = case
    restored = restored_by(method)
    # measured 11 (Richardson-Lucy) to 17 dB
    assert decibels(sharp, restored) > decibels(sharp, blurred) + 9


@every_method
def test_the_psf_is_not_flipped(method, case, restored_by):
    sharp, blurred, psf = case
    right = decibels(sharp, restored_by(method))
    for wrong in (psf[::-1], psf[:, ::-1], psf[::-1, ::-1]):
        # measured: a flip costs 8.6 (Richardson-Lucy) to 20 dB
        assert right > decibels(sharp, deconvolve(blurred, wrong, method)) + 6


@every_method
def test_the_picture_is_not_shifted(method, case, restored_by):
    sharp = case[0]
    restored = restored_by(method)
    errors = {
        (down, right): decibels(
            sharp[4:-4, 4:-4], np.roll(restored, (down, right), (0, 1))[4:-4, 4:-4]
        )
        for down in (-1, 0, 1)
        for right in (-1, 0, 1)
    }
    assert max(errors, key=errors.__getitem__) == (0, 0)


@pytest.mark.parametrize("method", NEARLY_FREE, ids=lambda m: type(m).__name__)
def test_a_delta_psf_returns_the_plane(method):
    plane = leaves((40, 53), 5)
    delta = np.zeros((5, 3))
    delta[2, 1] = 1
    # weight 1e-8 times the largest coupling, 1448, leaves less than 1e-4 of the differences
    np.testing.assert_allclose(deconvolve(plane, delta, method), plane, atol=1e-3)


@every_method
@pytest.mark.parametrize("shape", [(6, 7), (5, 8), (8, 6)])
def test_even_sided_psfs_keep_their_origin(method, shape):
    psf = np.zeros(shape)
    psf[shape[0] // 2, shape[1] // 2] = 1
    plane = leaves((60, 75), 6).astype(np.float32)
    restored = deconvolve(plane, psf, method)
    # a delta at the origin moves nothing; what the priors smooth away is far below a shift
    assert decibels(plane, restored) > decibels(plane, np.roll(plane, 1, 0)) + 6
    assert decibels(plane, restored) > decibels(plane, np.roll(plane, 1, 1)) + 6


@every_method
def test_borders_do_not_ring(method, case, restored_by):
    sharp, blurred, _ = case
    restored = restored_by(method)
    # within half a PSF of the border the scene is only half determined, yet it is sharpened:
    # measured 8 (Richardson-Lucy) to 11 dB; wrapping around loses 5 dB there
    frame = np.ones(sharp.shape, dtype=bool)
    frame[6:-6, 6:-6] = False
    assert decibels(sharp[frame], restored[frame]) > decibels(sharp[frame], blurred[frame]) + 6


@every_method
def test_the_border_does_not_reach_inward(method, case, restored_by):
    squared = (restored_by(method) - case[0]) ** 2
    inside = squared[24:-24, 24:-24].mean()
    squared[24:-24, 24:-24] = np.nan
    # two PSF sides from the border it no longer matters: measured .9 to 1.1 times the error
    # inside; wrapping around makes it 1.8 (Wiener) to 3.5 times
    assert np.nanmean(squared[18:-18, 18:-18]) < 1.5 * inside


@every_method
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_shape_and_kind_are_kept_and_the_input_is_untouched(method, dtype):
    plane = leaves((41, 58), 7).astype(dtype)
    before = plane.copy()
    plane.setflags(write=False)
    restored = deconvolve(plane, shake(), method)
    assert restored.shape == plane.shape
    assert restored.dtype == dtype
    assert restored.flags.c_contiguous
    np.testing.assert_array_equal(plane, before)


@every_method
def test_single_and_double_precision_agree(method, restored_by):
    single, double = restored_by(method), restored_by(method, np.float64)
    # rounding moves a few differences across a threshold, so compare by rms
    assert np.sqrt(np.mean((single - double) ** 2)) < 1e-3


@every_method
@pytest.mark.parametrize("value", [0.0, 0.3, 1.0])
def test_a_constant_plane_stays_constant(method, value):
    plane = np.full((50, 61), value, dtype=np.float32)
    # single precision through some 60 transforms
    np.testing.assert_allclose(deconvolve(plane, shake(), method), value, atol=1e-4)


@pytest.mark.parametrize("method", LINEAR_MODELS, ids=lambda m: type(m).__name__)
@pytest.mark.parametrize(("gain", "offset"), [(0.05, 0.1), (30.0, -4.0)])
def test_affine_changes_of_the_plane_change_the_result_alike(
    method, gain, offset, case, restored_by
):
    blurred, psf = case[1].astype(np.float64), case[2]
    expected = gain * restored_by(method, np.float64) + offset
    changed = deconvolve(gain * blurred + offset, psf, method)
    # double precision, but conjugate gradients stop at 1e-6 of the norm, offset included
    np.testing.assert_allclose(changed, expected, atol=2e-3 * gain)


def test_richardson_lucy_commutes_with_scale_and_is_not_negative(case, restored_by):
    blurred, psf = case[1].astype(np.float64), case[2]
    restored = restored_by(RichardsonLucy(), np.float64)
    assert restored.min() >= 0
    np.testing.assert_allclose(
        deconvolve(40 * blurred, psf, RichardsonLucy()), 40 * restored, rtol=1e-6
    )


@every_method
def test_turning_everything_turns_the_result(method, case, restored_by):
    _, blurred, psf = case
    expected = restored_by(method).T
    turned = deconvolve(np.ascontiguousarray(blurred.T), psf.T, method)
    # bands along rows are extended before those along columns: the corners of the gap differ
    assert np.sqrt(np.mean((turned - expected) ** 2)) < 3e-3


@every_method
def test_channels_are_restored_one_by_one(method):
    image = np.stack([leaves((44, 50), seed) for seed in (1, 2, 3)], axis=-1).astype("f4")
    restored = deconvolve(image, shake(), method)
    np.testing.assert_array_equal(restored[..., 1], deconvolve(image[..., 1], shake(), method))


@every_method
@pytest.mark.parametrize("shape", [(11, 9), (11, 400), (300, 10), (12, 13)])
def test_pictures_as_small_as_the_psf_are_accepted(method, shape):
    restored = deconvolve(leaves(shape, 8).astype(np.float32), shake(), method)
    assert np.isfinite(restored).all()
    assert np.abs(restored).max() < 10  # nothing blows up, though little is determined


@every_method
def test_progress_counts_up_to_the_total(method):
    seen: list[Progress] = []
    drain(deconvolving(leaves((40, 50), 9), shake(), method), seen.append)
    assert len({(each.stage, each.total) for each in seen}) == 1
    # parts of a step repeat its report; no step is left out, and none comes back
    done = [each.done for each in seen]
    assert done == sorted(done)
    assert sorted(set(done)) == list(range(seen[0].total + 1))


@every_method
@pytest.mark.parametrize("side", [(40, 50), (20, 24)])  # with bands at the border, and without
def test_a_job_can_be_stopped_between_any_two_transforms(method, side, monkeypatch):
    transforms, most = [], 0
    for name in ("rfftn", "irfftn"):
        monkeypatch.setattr(fft, name, counting(getattr(fft, name), transforms))
    for _ in deconvolving(leaves(side, 9), shake(5, 3), method):
        most = max(most, len(transforms))
        transforms.clear()
    assert most > 0
    assert max(most, len(transforms)) <= 2


def counting(function, calls):
    def counted(*arguments, **options):
        calls.append(function.__name__)
        return function(*arguments, **options)

    return counted


@every_method
def test_closing_the_job_stops_it(method):
    job = deconvolving(leaves((40, 50), 9), shake(), method)
    next(job)
    next(job)
    job.close()
    with pytest.raises(StopIteration):
        next(job)


@every_method
def test_methods_are_values(method):
    assert method == type(method)()
    assert hash(method) == hash(type(method)())
    with pytest.raises(FrozenInstanceError):
        setattr(method, fields(method)[0].name, 3)


@every_method
def test_statistics_of_the_whole_picture_replace_those_of_the_plane(method, case, restored_by):
    _, blurred, psf = case
    run = drain(method.run(blurred, psf, statistics=measure(blurred)))
    np.testing.assert_array_equal(run, restored_by(method))
    noisy = PlaneStatistics(noise=0.1, contrast=measure(blurred).contrast)
    smoother = drain(method.run(blurred, psf, statistics=noisy))
    if not isinstance(method, RichardsonLucy):  # which has no weight
        assert np.abs(np.diff(smoother)).sum() < np.abs(np.diff(run)).sum()
