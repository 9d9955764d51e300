"""What a PSF does to edges: cumulated marginals, matrices of pixels, and profiles of pixels."""

import numpy as np
import pytest
from adjoints import dot_test, linearity_test, uneven_psf, vector

from napari_crfdeblur.edges import checks
from napari_crfdeblur.edges.picture import Picture
from napari_crfdeblur.edges.sampling import Grids, interpolated
from napari_crfdeblur.edges.segments import gaussian_smoothed
from napari_crfdeblur.edges.strip import Frame
from napari_crfdeblur.profiles.fine import FineProfile, fit_profile, gather, pixels_near
from napari_crfdeblur.psf import project
from napari_crfdeblur.psf.projection import project_pixel
from napari_crfdeblur.psf.radon.edge_spreads import EdgeSpreads
from napari_crfdeblur.psf.radon.spread_fit import Placed, pixel_density
from napari_crfdeblur.psf.spectral_fit import SpectralFit
from napari_crfdeblur.simulate.profiles import edge_shape, random_displacement

ANGLES = [0.0, 0.3, np.pi / 4, np.pi / 2, 2.0, 3.0]
PSFS = [uneven_psf(sides) for sides in ((7, 5), (3, 9), (1, 5), (1, 1))]
every_angle = pytest.mark.parametrize("angle", ANGLES)
every_psf = pytest.mark.parametrize("psf", PSFS, ids=lambda p: f"{p.shape[0]}x{p.shape[1]}")
GRID = 2e-6  # an edge along the grid is smeared by a millionth of a pixel, the density by more


@every_psf
@pytest.mark.parametrize(("angle", "axis"), [(0.0, 0), (np.pi / 2, 1)])
def test_along_the_grid_an_edge_spread_is_the_cumulated_marginal(psf, angle, axis):
    marginal = psf.sum(axis=axis)
    borders = np.arange(marginal.size + 1) - marginal.size // 2 - 0.5
    expected = np.concatenate([[0.0], np.cumsum(marginal)])
    np.testing.assert_allclose(project(psf, angle, borders), expected, atol=GRID)


@every_psf
@every_angle
def test_an_edge_spread_is_the_integral_of_the_line_spread(psf, angle):
    normal = np.array([np.sin(angle), np.cos(angle)])
    places, step = np.linspace(-9, 9, 18001, retstep=True)
    pixels = np.indices(psf.shape).reshape(2, -1) - np.array(psf.shape)[:, None] // 2
    line = pixel_density(places[:, None] - normal @ pixels, normal) @ psf.ravel()
    spread = np.cumsum((line[1:] + line[:-1]) / 2) * step
    # jumps of the density, of at most 1, lie somewhere within a step
    np.testing.assert_allclose(project(psf, angle, places[1:]), spread, atol=2 * step)


@every_psf
@every_angle
def test_edge_spreads_are_linear_in_the_psf_and_turn_with_it(psf, angle):
    places = np.linspace(-6, 6, 25)
    linearity_test(lambda k: project(k, angle, places), psf.shape)
    turned = project(np.rot90(psf, -1), angle + np.pi / 2, places)
    np.testing.assert_allclose(turned, project(psf, angle, places), atol=1e-8)
    mirrored = project(psf.T, np.pi / 2 - angle, places)
    np.testing.assert_allclose(mirrored, project(psf, angle, places), atol=1e-8)


@every_psf
def test_no_place_and_no_angle_sees_less_than_nothing_or_more_than_all(psf):
    for angle in np.linspace(0, 2 * np.pi, 17):
        spread = project(psf, angle, np.linspace(-12, 12, 97))
        assert spread.min() >= 0
        assert spread.max() <= 1 + 1e-12


@every_angle
def test_pixels_side_by_side_make_a_larger_one(angle):
    normal, places = np.array([np.sin(angle), np.cos(angle)]), np.linspace(-4, 4, 33)
    corners = [normal @ np.array(offset) / 2 for offset in ((-1, -1), (-1, 1), (1, -1), (1, 1))]
    four = np.mean([project_pixel(places - corner, normal) for corner in corners], axis=0)
    np.testing.assert_allclose(four, project_pixel(places / 2, normal), atol=GRID)


@every_angle
@pytest.mark.parametrize("size", [3, 4, 7])
def test_the_matrix_of_pixels_is_the_projection(angle, size):
    places = np.arange(-8, 9) * 0.75
    rows = np.ones((2, places.size))
    profiles = project(uneven_psf((3, 3)), angle, places) * rows
    spreads = EdgeSpreads(places, angle, profiles, rows, np.ones((2, 2)))
    placed, psf = Placed.of(spreads), uneven_psf((size, size))
    matrix = placed.projection(size)
    spread = project(psf, angle, places - placed.origin)
    np.testing.assert_allclose(matrix.spread @ psf.ravel(), spread, atol=1e-12)
    function = matrix.shape(psf.ravel())
    np.testing.assert_allclose(function.spread, spread, atol=1e-12)
    step = 1e-3
    beside = [project(psf, angle, places - placed.origin + s) for s in (-step, step)]
    if np.abs(np.sin(2 * angle)) > 0.1:  # along the grid the slope jumps
        slope = (beside[1] - beside[0]) / (2 * step)
        np.testing.assert_allclose(function.slope, slope, atol=5 * step)
    pixels = (size * size,)
    dot_test(lambda k: matrix.spread @ k, lambda y: matrix.spread.T @ y, pixels, places.shape)


@pytest.mark.parametrize("seed", range(3))
def test_the_simulated_shape_of_an_edge_is_the_projection_of_its_motion(seed):
    way = np.rint(random_displacement(np.random.default_rng(seed), 9.0)).astype(int)
    psf = np.bincount(way + 5, minlength=11)[None] / way.size
    places = np.linspace(-8, 8, 33)
    np.testing.assert_allclose(edge_shape(places, way), project(psf, 0.0, places), atol=GRID)


FINE = FineProfile(
    np.sort(np.random.default_rng(1).uniform(-12, 12, 200)),
    np.random.default_rng(2).integers(1, 9, 200).astype(float),
    np.zeros((2, 200)),
    np.zeros((2, 200)),
)


POSITION = np.linspace(-9, 9, 25)


def fitted(mean):
    """The profile of means in bins, without their scatter."""
    fine = FineProfile(FINE.place, FINE.count, mean, mean**2)
    return fit_profile(fine, POSITION, 2.5, 1e-12).value


def test_a_profile_is_linear_in_its_pixels_and_follows_parabolas():
    linearity_test(fitted, (2, 200), tolerance=1e4)  # fits lose some digits
    powers = [np.stack([x**0, 0.3 * x - 0.01 * x**2]) for x in (FINE.place, POSITION)]
    np.testing.assert_allclose(fitted(powers[0]), powers[1], atol=1e-7)


@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi / 4, np.pi / 2, 2.5])
def test_gathering_counts_every_pixel_beside_an_edge_once_and_keeps_its_light(angle):
    image = np.random.default_rng(3).random((60, 71, 3))
    frame, reach = Frame((29.3, 34.8), angle, 33.0), 7.4
    row, column = pixels_near(image.shape[:2], frame, reach)
    assert len({*zip(row.tolist(), column.tolist(), strict=True)}) == row.size
    y, x = np.indices((60, 71))
    y, x = y - frame.center[0], x - frame.center[1]
    across = y * np.sin(angle) + x * np.cos(angle)
    along = x * np.sin(angle) - y * np.cos(angle)
    inside = (np.abs(across) <= reach) & (np.abs(along) <= frame.length / 2)
    assert row.size == inside.sum()
    fine = gather(image, frame, reach, 2.0)
    assert fine.count.sum() == row.size
    np.testing.assert_allclose(fine.mean @ fine.count, image[inside].sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(fine.place @ fine.count, across[inside].sum(), atol=1e-9)


GRIDS = Grids(
    center=np.array([[14.2, 20.1], [18.0, 12.7]]),
    normal=np.array([[0.6, 0.8], [-0.28, 0.96]]),
    along=np.array([np.linspace(-6, 6, 9), np.linspace(-5, 5, 9)]),
    across=np.arange(-4, 5.0),
)


def test_interpolation_is_linear_and_exact_on_planes():
    def sampled(x):
        return interpolated(Picture.of(x), GRIDS)

    linearity_test(sampled, (33, 41, 3), np.float32, tolerance=50)
    row, column = np.indices((33, 41), dtype=np.float32)
    ramp = 0.01 * row - 0.02 * column + 0.8
    tangent = np.stack([-GRIDS.normal[:, 1], GRIDS.normal[:, 0]], axis=1)
    y, x = (
        GRIDS.center[:, a, None, None]
        + tangent[:, a, None, None] * GRIDS.along[:, :, None]
        + GRIDS.normal[:, a, None, None] * GRIDS.across
        for a in (0, 1)
    )
    np.testing.assert_allclose(sampled(ramp)[0], 0.01 * y - 0.02 * x + 0.8, atol=3e-6)


@pytest.mark.parametrize("factor", [2, 3, 5])
def test_a_reduced_picture_has_the_means_of_its_squares(factor):
    image = vector((23, 31, 3), 4, np.float32)
    found = np.stack(Picture.of(image).reduced(factor).planes(), axis=-1)
    rows, columns = 23 // factor, 31 // factor
    squares = image[: rows * factor, : columns * factor]
    means = squares.reshape(rows, factor, columns, factor, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(found, means, atol=1e-6)


@pytest.mark.parametrize("sigma", [0.6, 1.3])
def test_smoothing_is_linear_keeps_what_is_even_and_is_the_same_transposed(sigma):
    linearity_test(lambda x: gaussian_smoothed(x, sigma), (21, 34), np.float32)
    np.testing.assert_allclose(gaussian_smoothed(np.full((9, 14), 0.4), sigma), 0.4, rtol=1e-12)
    plane = vector((21, 34), 5)
    np.testing.assert_allclose(
        gaussian_smoothed(plane.T, sigma), gaussian_smoothed(plane, sigma).T, atol=1e-13
    )


@pytest.mark.parametrize(("rows", "number"), [(10, 3), (16, 16), (7, 1), (50, 8)])
def test_blocks_along_an_edge_are_means_in_which_every_row_counts_once(rows, number):
    weights = checks.averaging(rows, number)
    np.testing.assert_allclose(weights.sum(axis=1), 1, rtol=1e-14)
    np.testing.assert_array_equal((weights > 0).sum(axis=0), 1)


def test_the_power_that_is_expected_has_its_adjoint():
    powers, passed = np.abs(vector((64, 33), 6)), np.abs(vector((64, 33), 7))
    fit = SpectralFit.of(powers, passed)
    unknowns, frequencies = (2 + fit.cell.max() + 1,), fit.powers.shape
    dot_test(fit._expected, lambda pull: len(pull) * fit._onto_values(pull), unknowns, frequencies)
