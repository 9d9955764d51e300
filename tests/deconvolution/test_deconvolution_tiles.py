"""Tiles: they cover the picture once, and their results fit together to that of the whole."""

from dataclasses import dataclass, field
from importlib import import_module

import numpy as np
import pytest
from scipy.signal import fftconvolve

from napari_crfdeblur.deconvolution import (
    Deconvolver,
    HyperLaplacian,
    RichardsonLucy,
    SparseIrls,
    Tiled,
    Wiener,
    deconvolve,
    measure,
)
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.progress import Progress
from napari_crfdeblur.psf import as_psf

NOISE = 0.005


def hook(height=9, width=7):
    """Asymmetric under both flips, its transpose and its half turn."""
    psf = np.zeros((height, width))
    psf[1 : height - 1, 2] = np.linspace(0.3, 1, height - 2)
    psf[height - 2, 2 : width - 1] = np.linspace(1, 2, width - 3)
    return psf / psf.sum()


def recorded(shape, seed=3):
    """Sharp blocks, and what a camera records of them."""
    psf = hook()
    rng = np.random.default_rng(seed)
    scene = np.kron(
        rng.uniform(0.1, 0.9, (shape[0] // 11 + 2, shape[1] // 13 + 2)), np.ones((11, 13))
    )
    scene = scene[: shape[0] + psf.shape[0] - 1, : shape[1] + psf.shape[1] - 1]
    blurred = fftconvolve(scene, psf, mode="valid") + rng.normal(0, NOISE, shape)
    top, left = psf.shape[0] // 2, psf.shape[1] // 2
    return scene[top : top + shape[0], left : left + shape[1]], blurred.astype(np.float32)


@dataclass(frozen=True)
class Spy(Deconvolver):
    """Gives back what it gets, and remembers it."""

    calls: list = field(default_factory=list)

    def run(self, plane, psf, *, clipped=None, weights=None, statistics=None):  # noqa: ARG002
        assert psf.shape == hook().shape
        self.calls.append((plane, clipped, statistics))
        yield Progress("spying", 1, 1)
        return plane


@pytest.mark.parametrize("shape", [(300, 211), (97, 640), (40, 33), (1, 500)])
@pytest.mark.parametrize(("side", "overlap"), [(90, 10), (64, 0), (200, None), (None, None)])
def test_tiles_cover_the_picture_once_and_fit_their_transforms(shape, side, overlap):
    psf = (9, 7)
    grid = Tiled(Wiener(), side=side, overlap=overlap).grid(shape, psf)
    hits = np.zeros(shape, dtype=int)
    for tile in grid:
        hits[tile.inner] += 1
        for own, wide, n, margin in zip(tile.inner, tile.outer, shape, grid.overlap, strict=True):
            assert wide.start == max(own.start - margin, 0)
            assert wide.stop == min(own.stop + margin, n)
        if side is not None:
            sizes = [part.stop - part.start for part in tile.outer]
            assert all(n + k - 1 <= side for n, k in zip(sizes, psf, strict=True))
        whole = np.zeros(shape)
        whole[tile.inner] = 1
        assert whole[tile.outer][tile.kept].all()
        assert whole[tile.outer].sum() == whole.sum()
    assert (hits == 1).all()
    assert len(list(grid)) == len(grid)


def test_tiles_put_together_are_the_picture():
    plane = np.random.default_rng(1).random((130, 171))
    tiled = deconvolve(plane, hook(), Tiled(Spy(), side=60, overlap=9))
    np.testing.assert_array_equal(tiled, plane)


INNER = np.s_[30:-30, 30:-30]  # where the gap beyond the frame, which depends on the size, is far


def rms(values):
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64))))


@pytest.mark.parametrize("steps", [1, 3, 5, 10, 30, 100])
def test_richardson_lucy_in_tiles_equals_the_whole(steps):
    _, blurred = recorded((230, 310))
    method = RichardsonLucy(steps)
    whole = deconvolve(blurred, hook(), method)
    tiles = deconvolve(blurred, hook(), Tiled(method, side=130))
    # what the steps carry further than their reach: measured .0001 to .09
    assert rms((tiles - whole)[INNER]) < 0.1 * NOISE


def test_more_steps_of_richardson_lucy_reach_farther():
    grids = [Tiled(RichardsonLucy(steps)).grid((4000, 4000), (21, 31)) for steps in (5, 30, 200)]
    assert [grid.overlap for grid in grids] == [(25, 37), (42, 62), (75, 110)]


@pytest.mark.parametrize(
    "method",
    [Wiener(), HyperLaplacian(), SparseIrls(), RichardsonLucy()],
    ids=lambda m: type(m).__name__,
)
def test_tiles_restore_as_well_as_the_whole(method):
    sharp, blurred = recorded((230, 310))
    whole = deconvolve(blurred, hook(), method)
    tiles = deconvolve(blurred, hook(), Tiled(method, side=120))
    assert tiles.dtype == np.float32
    # well below the noise of the photo, and so of what remains of it after restoration
    assert rms((tiles - whole)[INNER]) < NOISE / 4
    # at the frame both guess what lies beyond it, from other neighbors
    assert rms(tiles - sharp) < 1.05 * rms(whole - sharp)


def test_all_tiles_get_the_statistics_of_the_whole():
    _, blurred = recorded((230, 310))
    blurred[:, 200:] *= 0.1
    spy = Spy()
    deconvolve(blurred, hook(), Tiled(spy, side=100))
    found = {statistics for _, _, statistics in spy.calls}
    assert found == {measure(blurred, as_psf(hook()))}
    assert len(spy.calls) > 4


def test_clipped_pixels_are_cut_along():
    _, blurred = recorded((150, 190))
    clipped = blurred > 0.7
    spy = Spy()
    deconvolve(blurred, hook(), Tiled(spy, side=100), clipped=clipped)
    for plane, mask, _ in spy.calls:
        found = np.zeros(plane.shape, dtype=bool) if mask is None else mask
        np.testing.assert_array_equal(found, plane > 0.7)


def test_colors_are_tiled_one_by_one():
    planes = [recorded((120, 150), seed)[1] for seed in (1, 2, 3)]
    method = Tiled(RichardsonLucy(3), side=80)
    color = deconvolve(np.stack(planes, axis=2), hook(), method)
    for channel, plane in enumerate(planes):
        np.testing.assert_array_equal(color[..., channel], deconvolve(plane, hook(), method))


def test_volumes_are_tiled_along_all_axes():
    rng = np.random.default_rng(2)
    volume = rng.random((30, 41, 52)) + 0.1
    psf = rng.random((3, 5, 3))
    method = RichardsonLucy(3)
    whole = deconvolve(volume, psf, method)
    tiled = Tiled(method, side=24, overlap=6)
    grid = tiled.grid(volume.shape, psf.shape)
    assert min(grid.counts) > 1
    tiles = deconvolve(volume, psf, tiled)
    # the start is the mean of a tile, which hardly matters after the first step
    assert np.abs(tiles - whole).max() < 1e-2
    assert np.sqrt(np.mean((tiles - whole) ** 2)) < 1e-3


def test_flat_volumes_keep_their_slices_together():
    grid = Tiled(RichardsonLucy()).grid((12, 4000, 3000), (5, 9, 9))
    assert grid.counts[0] == 1
    assert grid.counts[1] > 1
    sides = [part.stop - part.start for part in grid.tile((0, 1, 1)).outer]
    assert np.prod(sides) < 1 << 23


@pytest.mark.torch
def test_torch_tensors_stay_tensors():
    torch = import_module("torch")
    _, blurred = recorded((150, 190))
    method = Tiled(RichardsonLucy(3), side=80)
    found = deconvolve(torch.asarray(blurred), hook(), method)
    assert isinstance(found, torch.Tensor)
    np.testing.assert_allclose(found.numpy(), deconvolve(blurred, hook(), method), atol=1e-5)


def test_the_plane_stays_as_it_is():
    _, blurred = recorded((150, 190))
    before = blurred.copy()
    deconvolve(blurred, hook(), Tiled(RichardsonLucy(2), side=80))
    np.testing.assert_array_equal(blurred, before)


def test_progress_counts_all_tiles():
    _, blurred = recorded((150, 190))
    job = Tiled(RichardsonLucy(2), side=80).run(blurred, hook())
    reports = list(job)
    shares = [each.done / each.total for each in reports]
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert "tile 2 of" in " ".join(each.stage for each in reports)


def test_a_side_without_room_for_a_tile_is_refused():
    with pytest.raises(ValueError, match="margins of a tile"):
        deconvolve(np.ones((90, 90)), hook(), Tiled(Wiener(), side=40))


def test_a_psf_larger_than_the_picture_is_refused():
    with pytest.raises(CrfDeblurError, match="larger than the image"):
        deconvolve(np.ones((8, 90)), hook(), Tiled(Wiener()))


@pytest.mark.parametrize("options", [{"side": 0}, {"overlap": -1}])
def test_impossible_tiles_are_refused(options):
    with pytest.raises(ValueError, match="expected"):
        Tiled(Wiener(), **options)


def test_tiles_of_tiles_are_refused():
    with pytest.raises(ValueError, match="makes tiles itself"):
        Tiled(Tiled(Wiener()))
