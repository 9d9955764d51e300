"""Pictures in parts: every pixel is covered once, and what was cut is put together again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from adjoints import AT, PRECISIONS, dot_test, linearity_test, uneven_psf, vector
from scipy import ndimage

from napari_crfdeblur import arrays
from napari_crfdeblur.boundary import frame
from napari_crfdeblur.deconvolution import (
    Deconvolver,
    Tiled,
    deconvolve,
    deconvolve_varying,
    highlights,
    varying,
)
from napari_crfdeblur.deconvolution.tiles import Grid
from napari_crfdeblur.large.windows import pieces
from napari_crfdeblur.psf import Poses, PsfField, PsfStatus, misfit, parts
from napari_crfdeblur.psf.field.base import part_centers


@dataclass(frozen=True, slots=True)
class Identity(Deconvolver):
    """Gives back what it is given."""

    def run(self, plane, psf, *, clipped=None, weights=None, statistics=None):  # noqa: ARG002
        del psf, clipped, statistics
        yield AT
        return plane


@dataclass(frozen=True, slots=True)
class Blurring(Deconvolver):
    """Blurs once more, with nothing beyond the border: linear, and exactly as far as the PSF."""

    def run(self, plane, psf, *, clipped=None, weights=None, statistics=None):  # noqa: ARG002
        del clipped, statistics
        yield AT
        return ndimage.convolve(plane, psf, mode="constant")


def field_of(shape, grid, sides=(5, 7), turn=None):
    """Different PSFs in all parts, or those of a camera that turned."""
    psfs = np.stack([uneven_psf(sides, seed) for seed in range(grid[0] * grid[1])])
    statuses = ((PsfStatus.GOOD,) * grid[1],) * grid[0]
    poses = None
    if turn is not None:
        times = np.stack([uneven_psf(sides, seed) for seed in range(3)]) / 3
        poses = Poses(np.array([-turn, 0.0, turn]), times)
    return PsfField(psfs.reshape(*grid, *sides), statuses, shape, poses)


TILINGS = [
    ((30, 41), (7, 10), (0, 0)),
    ((31, 40), (8, 9), (3, 5)),
    ((5, 64), (5, 13), (2, 70)),
    ((1, 9), (1, 1), (1, 1)),
    ((9, 20, 13), (4, 7, 13), (1, 2, 3)),
]


@pytest.mark.parametrize(("shape", "steps", "overlap"), TILINGS)
def test_the_tiles_of_a_grid_hold_every_pixel_once(shape, steps, overlap):
    grid, hits = Grid(shape, steps, overlap), np.zeros(shape, int)
    for tile in grid:
        hits[tile.inner] += 1
        marks = np.zeros(shape, int)
        marks[tile.inner] = 1
        np.testing.assert_array_equal(marks[tile.outer][tile.kept], 1)
    np.testing.assert_array_equal(hits, 1)
    assert len([*grid]) == len(grid)


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize(("shape", "steps", "overlap"), TILINGS)
def test_cutting_into_tiles_is_the_adjoint_of_adding_them_up(shape, steps, overlap, dtype):
    tiles = [*Grid(shape, steps, overlap)]
    sizes = [[part.stop - part.start for part in tile.outer] for tile in tiles]
    ends = np.cumsum([np.prod(size) for size in sizes])

    def cut(plane):
        return np.concatenate([plane[tile.outer].ravel() for tile in tiles])

    def added(values):
        total = np.zeros(shape, dtype)
        for tile, size, part in zip(tiles, sizes, np.split(values, ends[:-1]), strict=True):
            total[tile.outer] += part.reshape(size)
        return total

    dot_test(cut, added, shape, (int(ends[-1]),), dtype)


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize(
    ("shape", "sides"), [((90, 131), (4, 7)), ((133, 60), (9, 2)), ((40, 37, 45), (3, 5, 4))]
)
def test_tiles_of_a_local_operator_are_the_whole_where_margins_hold_its_reach(shape, sides, dtype):
    plane, psf = vector(shape, 1, dtype), uneven_psf(sides)
    whole = deconvolve(plane, psf, Blurring())

    def tiled(overlap):
        return deconvolve(plane, psf, Tiled(Blurring(), side=36, overlap=overlap))

    limit = 1e-5 if dtype is np.float32 else 1e-14
    np.testing.assert_allclose(tiled(max(sides) // 2), whole, rtol=0, atol=limit)
    assert np.abs(tiled(0) - whole).max() > 0.01


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize("shape", [(90, 131), (131, 90, 3)])
def test_tiles_of_the_identity_are_the_picture(shape, dtype):
    picture, psf = vector(shape, 2, dtype), uneven_psf((5, 3))
    np.testing.assert_array_equal(deconvolve(picture, psf, Tiled(Identity(), side=37)), picture)


SPANS = [(1, 1, 0), (80, 1, 5), (81, 2, 9), (100, 7, 0), (333, 4, 40), (12, 12, 1), (50, 25, 3)]


@pytest.mark.parametrize(("side", "count", "margin"), SPANS)
def test_the_weights_of_the_windows_of_an_axis_are_one_in_sum(side, count, margin):
    total, middles = np.zeros(side), []
    for middle, inside, wide, weight in varying.spans(side, count, margin):
        assert (weight > 0).all()
        total[inside] += weight
        assert wide.start == max(inside.start - margin, 0)
        assert wide.stop == min(inside.stop + margin, side)
        middles.append(middle)
    np.testing.assert_allclose(total, 1, rtol=1e-14)
    np.testing.assert_allclose(middles, side - 1 - np.array(middles)[::-1], atol=1e-12)
    assert len(middles) == count


FIELDS = {
    "parts": lambda: field_of((161, 233), (2, 3)),
    "tall": lambda: field_of((230, 81), (4, 1)),
    "turned": lambda: field_of((161, 233), (1, 1), (7, 7), turn=0.02),
    "one PSF": lambda: field_of((75, 74), (1, 1)),
}
every_field = pytest.mark.parametrize("field", [make() for make in FIELDS.values()], ids=FIELDS)


@every_field
def test_the_windows_of_a_picture_are_one_in_sum_and_know_their_middles(field):
    total = np.zeros(field.shape)
    for window in varying._windows(field):
        total[window.inner] += window.weight
        marks = np.zeros(field.shape)
        marks[window.inner] = 1
        np.testing.assert_array_equal(marks[window.outer][window.kept], 1)
        assert all(
            part.start <= middle <= part.stop - 1
            for part, middle in zip(window.inner, window.center, strict=True)
        )
    np.testing.assert_allclose(total, 1, atol=3e-7)  # weights in single precision


@every_field
@pytest.mark.parametrize("side", [70, 110])
def test_pieces_of_windows_in_tiles_add_up_to_the_windows_of_the_whole(field, side):
    picture, total = vector(field.shape, 3), np.zeros(field.shape)
    grid = Tiled(Identity(), side=side, overlap=8).grid(field.shape, field.psfs.shape[2:])
    for tile in grid:
        part = np.zeros([own.stop - own.start for own in tile.inner])
        for piece in pieces(field, tile):
            part[piece.inner] += piece.weight * picture[tile.outer][piece.outer][piece.kept]
        total[tile.inner] += part
    np.testing.assert_allclose(total, picture, atol=2e-6)  # weights in single precision


@every_field
@pytest.mark.parametrize(
    ("dtype", "colors"), [(np.float32, ()), (np.float64, ()), (np.float32, (2,))]
)
def test_windows_of_the_identity_are_the_picture(field, dtype, colors):
    picture = vector((*field.shape, *colors), 4, dtype)
    found = deconvolve_varying(picture, field, Identity())
    assert found.dtype == dtype
    np.testing.assert_allclose(found, picture, atol=2e-6)  # weights in single precision


def test_windows_blur_linearly_and_their_middles_by_their_own_psfs():
    field = field_of((150, 225), (2, 3))  # windows of 75 pixels, whose middles are pixels
    linearity_test(lambda x: deconvolve_varying(x, field, Blurring()), field.shape)
    picture, windows = vector(field.shape, 5), [*varying._windows(field)]
    found = deconvolve_varying(picture, field, Blurring())
    assert len(windows) == 6
    for window in windows:
        place = tuple(int(middle) for middle in window.center)
        assert place == window.center
        expected = ndimage.convolve(picture, field.at(*place), mode="constant")
        assert found[place] == pytest.approx(expected[place], rel=1e-12)


@pytest.mark.parametrize("shape", [(120, 80), (37, 200), (75, 74)])
@pytest.mark.parametrize("grid", [(1, 1), (2, 3), (5, 1)])
def test_the_psf_between_parts_is_a_weighted_mean_of_theirs(shape, grid):
    field = field_of(shape, grid)
    places = np.random.default_rng(6).uniform(-0.5, np.array(shape) - 0.5, (20, 2))
    for place in places:
        psf = field.at(*place)
        assert psf.sum() == pytest.approx(1, rel=1e-14)
        assert (psf >= field.psfs.min(axis=(0, 1)) - 1e-15).all()
        assert (psf <= field.psfs.max(axis=(0, 1)) + 1e-15).all()
    for part in np.ndindex(grid):
        np.testing.assert_allclose(field.at(*field.centers[part]), field.psfs[part], atol=1e-14)
    np.testing.assert_allclose(
        part_centers(shape, grid).mean(axis=(0, 1)), (np.array(shape) - 1) / 2, atol=1e-12
    )


def covered(shape: tuple[int, ...], boxes: Sequence[tuple[slice, ...]]):
    """How often every pixel is in a box."""
    hits = np.zeros(shape, int)
    for box in boxes:
        assert all(0 <= s.indices(n)[0] < s.stop <= n for s, n in zip(box, shape, strict=True))
        hits[box] += 1
    return hits


@pytest.mark.parametrize(("shape", "grid"), [((90, 141), (2, 3)), ((200, 61), (5, 1))])
def test_windows_in_which_psfs_are_looked_for_cover_the_picture_and_their_parts(shape, grid):
    windows = parts._windows(shape, grid, 5)
    assert covered(shape, windows).min() >= 1
    for window, center in zip(windows, part_centers(shape, grid).reshape(-1, 2), strict=True):
        assert all(s.start <= place < s.stop for s, place in zip(window, center, strict=True))


@pytest.mark.parametrize("shape", [(64, 130), (201, 64), (77, 99)])
def test_windows_of_the_misfit_cover_the_picture(shape):
    assert covered(shape, list(misfit._boxes(shape, (64, 64)))).min() >= 1


@pytest.mark.parametrize("share", [0.001, 0.02, 0.9])
@pytest.mark.parametrize(("shape", "sides"), [((61, 90), (5, 3)), ((12, 20, 17), (3, 3, 5))])
def test_boxes_around_highlights_hold_them_with_their_margin(shape, sides, share):
    clipped = np.random.default_rng(7).random(shape) < share
    clipped.flat[17] = True
    hits = covered(shape, list(highlights._boxes(clipped, sides)))
    for place in np.argwhere(clipped):
        around = tuple(
            slice(max(p - highlights.MARGIN * s, 0), p + highlights.MARGIN * s + 1)
            for p, s in zip(place, sides, strict=True)
        )
        assert hits[around].min() >= 1


@pytest.mark.parametrize("size", [1, 40, 1 << 20])
@pytest.mark.parametrize("shape", [(17, 24), (1, 30), (6, 7, 10), (5,)])
def test_blocks_of_rows_hold_every_row_once(shape, size):
    rows = [row for block in arrays.row_blocks(shape, size) for row in range(*block.indices(1000))]
    assert rows == [*range(shape[0])]


def test_the_frame_of_a_picture_is_cut_and_padded_by_adjoints():
    shape, period = (7, 9, 4), (8, 12, 5)

    def padded(y):
        wide = np.zeros(period)
        wide[frame(shape)] = y
        return wide

    dot_test(lambda x: x[frame(shape)].copy(), padded, period, shape)
