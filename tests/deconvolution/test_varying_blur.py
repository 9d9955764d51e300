"""Deconvolution with a PSF for every part: windows without seams, better where blur varies."""

import numpy as np
import pytest

from napari_crfdeblur.deconvolution import HyperLaplacian, Wiener, deconvolve
from napari_crfdeblur.deconvolution.varying import (
    _windows,
    deconvolve_varying,
    deconvolving_varying,
)
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.psf import Poses, PsfField, PsfStatus, camera_shake
from napari_crfdeblur.psf.field.base import offset_from_middle, part_centers
from napari_crfdeblur.psf.field.poses import fit_poses, turns_within
from napari_crfdeblur.quality import psnr
from napari_crfdeblur.response import Identity
from napari_crfdeblur.simulate import Camera, camera_turn, simulate, slanted_edges


def field_of(psfs, shape, poses=None):
    """Field of PSFs (R, C, H, W)."""
    statuses = tuple((PsfStatus.GOOD,) * psfs.shape[1] for _ in range(psfs.shape[0]))
    return PsfField(psfs, statuses, shape, poses)


@pytest.fixture(scope="module")
def turned():
    scene = slanted_edges((200, 260), seed=1, pitch=50, channels=3)
    motion = camera_turn(9, 0.06, 4, (200, 260))
    return simulate(scene, motion, Camera(Identity(), noise=0.002, bits=None), seed=2)


@pytest.fixture(scope="module")
def truth(turned):
    shape, grid = turned.photo.shape[:2], (3, 4)
    offsets = [offset_from_middle(c, shape) for c in part_centers(shape, grid).reshape(-1, 2)]
    psfs = [turned.motion.psf_at(offset) for offset in offsets]
    size = max(max(psf.shape) for psf in psfs)
    psfs = np.stack([np.pad(p, [((size - side) // 2,) * 2 for side in p.shape]) for p in psfs])
    offsets = np.array(offsets)
    turns = turns_within(size / 4, np.hypot(*offsets.T).max())
    poses = fit_poses(psfs, offsets, np.ones(len(psfs)), turns)
    return field_of(psfs.reshape(*grid, size, size), shape, poses)


def test_one_psf_everywhere_is_ordinary_deconvolution(turned):
    light, psf = turned.photo[..., 1], camera_shake(7, 2)
    still = Poses(np.zeros(1), psf[None])
    whole = deconvolve(light, psf, Wiener())
    once = deconvolve_varying(light, field_of(psf[None, None], light.shape, still), Wiener())
    np.testing.assert_array_equal(once, whole)


def test_windows_leave_no_seams():
    psf = camera_shake(7, 2)
    scene = slanted_edges((260, 340), seed=1, pitch=50)
    light = simulate(scene, psf, Camera(Identity(), noise=0.002, bits=None)).photo
    same = field_of(np.broadcast_to(psf, (2, 3, *psf.shape)), light.shape)
    whole = deconvolve(light, psf, HyperLaplacian())
    windows = deconvolve_varying(light, same, HyperLaplacian())
    # of full scale, about one level of 8 bits: what lies beyond the margin of a window
    assert np.sqrt(np.mean((windows - whole) ** 2)) < 5e-3
    # a seam would stand out where the weight of a window begins
    inner = np.abs(windows - whole)[20:-20, 20:-20]
    assert inner.max() < 0.15


def test_the_weights_of_all_windows_are_one_in_sum():
    field = field_of(np.full((3, 4, 5, 5), 1 / 25), (241, 333))
    total = np.zeros(field.shape)
    windows = list(_windows(field))
    for window in windows:
        total[window.inner] += window.weight
    assert len(windows) > 4
    np.testing.assert_allclose(total, 1, atol=1e-6)  # float32


def test_psfs_of_all_places_beat_that_of_the_middle(turned, truth):
    def quality(sharp):
        return psnr(np.clip(sharp, 0, 1), turned.sharp_linear)

    one = quality(deconvolve(turned.photo, turned.psf, HyperLaplacian()))
    all_of_them = quality(deconvolve_varying(turned.photo, truth, HyperLaplacian()))
    assert all_of_them > one + 2


def test_color_stays_color_and_kinds_stay(turned, truth):
    light = turned.photo.astype(np.float64)
    result = deconvolve_varying(light, truth, Wiener())
    assert result.shape == light.shape
    assert result.dtype == np.float64
    gray = deconvolve_varying(np.ascontiguousarray(light[..., 2]), truth, Wiener())
    np.testing.assert_allclose(gray, result[..., 2], atol=1e-9)


def test_clipped_pixels_go_along(turned, truth):
    light = np.minimum(turned.photo, 0.6).astype(np.float32)
    clipped = light >= 0.6
    known = deconvolve_varying(light, truth, Wiener(), clipped=clipped)
    naive = deconvolve_varying(light, truth, Wiener())
    assert known.shape == light.shape
    assert not np.array_equal(known, naive)


def test_progress_rises_and_the_job_can_be_stopped(turned, truth):
    job = deconvolving_varying(turned.photo[..., 0], truth, Wiener())
    reports = [next(job) for _ in range(6)]
    done = [report.done for report in reports]
    assert done == sorted(done)
    job.close()
    with pytest.raises(StopIteration):
        next(job)


def test_what_does_not_fit_is_refused(turned, truth):
    light = turned.photo[..., 0]
    with pytest.raises(ValueError, match="expected an image of"):
        deconvolve_varying(light[:-1], truth, Wiener())
    with pytest.raises(ValueError, match="float32 or float64"):
        deconvolve_varying((light * 255).astype(np.uint8), truth, Wiener())
    with pytest.raises(ValueError, match="clipped pixels of shape"):
        deconvolve_varying(light, truth, Wiener(), clipped=np.zeros((2, 2), dtype=bool))
    broken = light.copy()
    broken[3, 4] = np.nan
    with pytest.raises(CrfDeblurError, match="finite"):
        deconvolve_varying(broken, truth, Wiener())
    small = field_of(np.ones((1, 1, 31, 31)) / 961, (20, 40))
    with pytest.raises(CrfDeblurError, match="larger than the image"):
        deconvolve_varying(light[:20, :40], small, Wiener())
