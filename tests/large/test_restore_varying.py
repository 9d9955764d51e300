"""Blur that varies, undone tile by tile: what windows of the whole in memory would give."""

import cloudpickle
import numpy as np
import pytest
import tifffile
from scipy.ndimage import gaussian_filter

from napari_crfdeblur.deconvolution import HyperLaplacian, RichardsonLucy, Tiled, deconvolve_varying
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.large import open_source, restore_large
from napari_crfdeblur.large.windows import pieces
from napari_crfdeblur.photo import from_unit
from napari_crfdeblur.psf import Poses, PsfField, PsfStatus, camera_shake
from napari_crfdeblur.response import SRGB, clipped_light, linearize, reapply

da = pytest.importorskip("dask.array")

SHAPE = (170, 230)
TILED = Tiled(RichardsonLucy(3), side=128)


def a_field(shape=SHAPE):
    """PSFs of 2 x 3 parts, of different shakes."""
    psfs = np.stack([camera_shake(7, seed) for seed in range(6)]).reshape(2, 3, 7, 7)
    return PsfField(psfs, ((PsfStatus.GOOD,) * 3,) * 2, shape)


def turning(shape=SHAPE):
    """Those of a camera that turned."""
    shake = np.stack([camera_shake(7, 3)] * 3) / 3
    poses = Poses(np.array([-0.02, 0.0, 0.02]), shake)
    psf = poses.psf_at((0.0, 0.0))
    return PsfField(psf[None, None], ((PsfStatus.GOOD,),), shape, poses)


def a_photo(shape, seed=4):
    """Soft and asymmetric, with some pixels at full scale."""
    smooth = gaussian_filter(np.random.default_rng(seed).random(shape), (3, 2, 0)[: len(shape)])
    smooth -= smooth.min()
    return from_unit(1.1 * smooth / smooth.max(), np.float32)


def in_memory(photo, field, method):
    light, clipped = linearize(photo, SRGB()), clipped_light(photo)
    sharp = deconvolve_varying(light, field, method, clipped=clipped)
    return reapply(sharp, SRGB(), photo.dtype)


@pytest.mark.parametrize("field", [a_field, turning])
def test_the_weights_of_all_pieces_are_one_in_every_tile(field):
    psfs = field((241, 333))
    for tile in Tiled(RichardsonLucy(3), side=110).grid((241, 333), psfs.psfs.shape[2:]):
        total = np.zeros([own.stop - own.start for own in tile.inner])
        for piece in pieces(psfs, tile):
            total[piece.inner] += piece.weight
        np.testing.assert_allclose(total, 1, atol=1e-6)  # float32


@pytest.mark.parametrize("field", [a_field, turning])
@pytest.mark.parametrize(
    ("shape", "method"),
    [(SHAPE, RichardsonLucy(3)), ((*SHAPE, 3), RichardsonLucy(3)), (SHAPE, HyperLaplacian())],
)
def test_a_single_tile_is_the_whole(field, shape, method):
    photo = a_photo(shape)
    found = restore_large(photo, SRGB(), field(), method)
    assert found.npartitions == 1
    np.testing.assert_array_equal(found.compute(), in_memory(photo, field(), method))


@pytest.mark.parametrize(
    ("method", "tolerance"),
    # of full scale: single precision; and the reach of a method that knows no bounds, of which
    # margins of two PSF sides leave as much as in tiles of a picture with one PSF
    [(RichardsonLucy(3), 2e-6), (HyperLaplacian(weight=0.1), 4e-3)],
)
def test_tiles_agree_with_the_whole(tmp_path, method, tolerance):
    shape = (170, 200)
    photo, field = a_photo(shape), a_field(shape)
    tifffile.imwrite(tmp_path / "a.tif", photo, tile=(64, 64), photometric="minisblack")
    # at the frame, whole and tiles guess what is beyond from other neighbors
    inside = (slice(15, -15), slice(15, -15))
    expected = in_memory(photo, field, method)[inside]
    for large in (tmp_path / "a.tif", da.from_array(photo, chunks=90)):
        found = restore_large(large, SRGB(), field, Tiled(method, side=128, overlap=14))
        assert min(found.numblocks) > 1
        np.testing.assert_allclose(found.compute()[inside], expected, atol=tolerance)


def test_pages_and_alpha_go_along():
    stack = np.stack([a_photo((*SHAPE, 4), seed) for seed in (1, 2)])
    found = restore_large(stack, SRGB(), turning(), TILED).compute()
    np.testing.assert_array_equal(found[..., 3], stack[..., 3])
    own = restore_large(stack[1, ..., :3], SRGB(), turning(), TILED)
    # statistics are those of the whole stack, which is alike
    assert np.abs(found[1, ..., :3] - own.compute()).max() < 1e-6


def test_a_tile_can_be_computed_elsewhere(tmp_path):
    tifffile.imwrite(tmp_path / "a.tif", a_photo(SHAPE), photometric="minisblack")
    found = restore_large(open_source(tmp_path / "a.tif"), SRGB(), turning(), TILED)
    sent = cloudpickle.loads(cloudpickle.dumps(found))
    np.testing.assert_array_equal(sent[:50, :60].compute(), found[:50, :60].compute())


def test_psfs_of_another_picture_are_refused():
    photo = a_photo(SHAPE)
    with pytest.raises(ValueError, match=r"expected a photo of \(170, 231\) as the PSFs"):
        restore_large(photo, SRGB(), a_field((170, 231)), TILED)
    with pytest.raises(CrfDeblurError, match="larger than the image"):
        restore_large(photo[:6], SRGB(), a_field((6, 230)), TILED)
