"""Photos restored tile by tile from where they lie: what the whole in memory would give."""

import numpy as np
import pytest
import tifffile
from scipy.ndimage import gaussian_filter

from napari_crfdeblur.deconvolution import RichardsonLucy, Tiled, Wiener, deconvolve
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.large import (
    informative_region,
    measure_large,
    open_source,
    restore_large,
    statistics,
)
from napari_crfdeblur.photo import from_unit
from napari_crfdeblur.psf import PsfField, PsfStatus, camera_shake
from napari_crfdeblur.response import SRGB, Gamma, clipped_light, linearize, reapply

PSF = camera_shake(9, 3)
METHOD = Tiled(RichardsonLucy(3), side=120)


def a_photo(shape, dtype=np.uint8, seed=4):
    """Soft and asymmetric, with some pixels at full scale."""
    values = np.random.default_rng(seed).random(shape)
    smooth = gaussian_filter(values, (3, 2, 0)[: len(shape)] if len(shape) < 4 else (0, 3, 2, 0))
    smooth -= smooth.min()
    return from_unit(1.1 * smooth / smooth.max(), dtype)


def in_memory(photo, curve, method=METHOD, psf=PSF):
    light = linearize(photo, curve)
    sharp = deconvolve(light, psf, method, clipped=clipped_light(photo))
    return reapply(sharp, curve, photo.dtype)


def one_everywhere(shape):
    """The same PSF in two parts."""
    return PsfField(np.stack([PSF, PSF])[None], ((PsfStatus.GOOD,) * 2,), shape)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("shape", [(210, 170), (210, 170, 3)])
def test_a_file_a_dask_array_and_the_whole_give_the_same(tmp_path, shape, dtype):
    da = pytest.importorskip("dask.array")
    photo = a_photo(shape, dtype)
    kind = "rgb" if len(shape) == 3 else "minisblack"
    tifffile.imwrite(tmp_path / "a.tif", photo, tile=(64, 64), photometric=kind)
    expected = in_memory(photo, SRGB())
    lazy = da.from_array(photo, chunks=(50, 70, 3)[: len(shape)])
    for large in (tmp_path / "a.tif", lazy, photo):
        found = restore_large(large, SRGB(), PSF, METHOD)
        assert isinstance(found, da.Array)
        assert (found.shape, found.dtype) == (photo.shape, photo.dtype)
        assert min(found.numblocks[:2]) > 1
        np.testing.assert_array_equal(found.compute(), expected)


def test_nothing_is_read_before_it_is_asked_for(tmp_path):
    tifffile.imwrite(tmp_path / "a.tif", a_photo((210, 170)), tile=(64, 64))
    found = restore_large(tmp_path / "a.tif", Gamma(2.2), PSF, METHOD)
    (tmp_path / "a.tif").unlink()
    with pytest.raises(CrfDeblurError, match="cannot be read"):
        found[:5, :5].compute()


def test_each_channel_has_its_curve():
    photo, curves = a_photo((150, 130, 3)), [Gamma(1.8), Gamma(2.2), SRGB()]
    found = restore_large(photo, curves, PSF, METHOD).compute()
    np.testing.assert_array_equal(found, in_memory(photo, curves))


def test_alpha_is_kept():
    photo = a_photo((150, 130, 4))
    found = restore_large(photo, SRGB(), PSF, METHOD).compute()
    np.testing.assert_array_equal(found[..., 3], photo[..., 3])
    np.testing.assert_array_equal(found[..., :3], in_memory(photo[..., :3], SRGB()))


def test_slices_of_a_stack_are_restored_one_by_one():
    stack = np.stack([a_photo((150, 130), seed=seed) for seed in range(3)])
    found = restore_large(stack, SRGB(), PSF, METHOD)
    assert found.numblocks[0] == 3
    for one, photo in zip(found, stack, strict=True):
        np.testing.assert_array_equal(one.compute(), in_memory(photo, SRGB()))


def test_stacks_of_color_are_restored_too():
    stack = a_photo((2, 110, 130, 3))
    found = restore_large(stack, SRGB(), PSF, METHOD).compute()
    np.testing.assert_array_equal(found[1], in_memory(stack[1], SRGB()))


def test_volumes_are_restored_with_a_psf_of_three_dimensions():
    rng = np.random.default_rng(6)
    volume, psf = 0.9 * rng.random((20, 40, 50), np.float32), rng.random((3, 5, 5))
    method = Tiled(RichardsonLucy(2), side=26, overlap=5)
    curve = Gamma(1.0)
    found = restore_large(volume, curve, psf, method)
    assert min(found.numblocks) > 1
    flat = volume.reshape(-1, 50)
    light = linearize(flat, curve).reshape(volume.shape)
    sharp = deconvolve(light, psf, method).reshape(flat.shape)
    expected = reapply(sharp, curve, np.float32).reshape(volume.shape)
    np.testing.assert_array_equal(found.compute(), expected)


def test_a_method_that_says_nothing_of_tiles_gets_them():
    photo = a_photo((150, 130))
    found = restore_large(photo, SRGB(), PSF, Wiener())
    np.testing.assert_array_equal(found.compute(), in_memory(photo, SRGB(), Tiled(Wiener())))


def test_statistics_of_a_sample_are_near_those_of_the_whole(monkeypatch):
    monkeypatch.setattr(statistics, "PATCH", 128)  # photos of one megapixel are large then
    photo = a_photo((1150, 1050), np.uint16)
    (found,) = measure_large(photo, SRGB(), channels=False, psf=PSF)
    (whole,) = measure_large(photo[:512, :512], SRGB(), channels=False, psf=PSF)
    assert found.noise == pytest.approx(whole.noise, rel=0.2)
    assert found.contrast == pytest.approx(whole.contrast, rel=0.2)
    assert found.misfit == pytest.approx(whole.misfit, rel=0.3)
    (varying,) = measure_large(photo, SRGB(), channels=False, psf=one_everywhere(photo.shape))
    assert varying.misfit == pytest.approx(found.misfit, rel=0.3)
    (alone,) = measure_large(photo, SRGB(), channels=False)
    assert alone.misfit is None


@pytest.mark.parametrize("value", [np.nan, np.inf, 1.5, -0.1])
def test_a_bad_pixel_is_reported_when_its_tile_is_computed(value):
    photo = a_photo((210, 170), np.float32)
    statistics = measure_large(photo, SRGB(), channels=False)
    photo[200, 160] = value
    found = restore_large(photo, SRGB(), PSF, METHOD, statistics=statistics)
    found[:20, :20].compute()
    with pytest.raises(CrfDeblurError, match=r"not finite|has values from"):
        found.compute()


def test_wrong_arguments_are_refused():
    photo = a_photo((60, 50))
    with pytest.raises(CrfDeblurError, match="larger than the image"):
        restore_large(photo[:8], SRGB(), PSF, METHOD)
    with pytest.raises(CrfDeblurError, match="zero everywhere"):
        restore_large(photo, SRGB(), np.zeros((3, 3)), METHOD)
    with pytest.raises(ValueError, match="expected an image of uint8"):
        restore_large(photo.astype(np.int32), SRGB(), PSF, METHOD)
    with pytest.raises(ValueError, match="PSF of 2 axes"):
        restore_large(photo[0], SRGB(), PSF, METHOD)
    with pytest.raises(ValueError, match="PSF of 2 axes"):
        restore_large(photo[:0], SRGB(), PSF, METHOD)


def test_the_informative_part_is_where_edges_cross(tmp_path):
    photo = np.full((400, 600, 3), 120, np.uint8)
    photo[:, :300] += (np.arange(300) // 20 % 2 * 60).astype(np.uint8)[:, None]  # stripes
    checks = (np.add.outer(np.arange(200) // 20, np.arange(300) // 20) % 2) * 60
    photo[200:, 300:] += checks[..., None].astype(np.uint8)
    tifffile.imwrite(tmp_path / "a.tif", photo, photometric="rgb")
    source = open_source(tmp_path / "a.tif")
    region = informative_region(source, 200, 300)
    assert region == (slice(200, 400), slice(300, 600), slice(0, 3))
    whole = informative_region(source)
    assert whole == (slice(0, 400), slice(0, 600), slice(0, 3))
