"""Linear systems that transforms solve in one step: what they give satisfies its equations."""

from functools import partial

import numpy as np
import pytest
from adjoints import AT, PRECISIONS, ROUNDING, dot_test, linearity_test, uneven_psf, vector

from napari_crfdeblur import arrays, fourier
from napari_crfdeblur.boundary import banding
from napari_crfdeblur.deconvolution import irls, local_shrinkage, loops, splitting, wiener
from napari_crfdeblur.deconvolution.recorded import MaskedBlur, Recorded
from napari_crfdeblur.progress import drain

CASES = [((24, 35), (5, 3)), ((25, 18), (4, 7)), ((1, 30), (1, 4)), ((8, 9, 15), (3, 5, 2))]
every_case = pytest.mark.parametrize(("shape", "sides"), CASES)
every_precision = pytest.mark.parametrize("dtype", PRECISIONS)
COUPLING = 0.3


@pytest.fixture(params=[1 << 16, 1], ids=["at once", "row by row"])
def _blocked(request, monkeypatch):
    monkeypatch.setattr(arrays, "BLOCK", request.param)


blocked = pytest.mark.usefixtures("_blocked")


def laplacian(plane):
    """``D'D x`` by its definition."""
    return sum(
        2 * plane - np.roll(plane, 1, axis) - np.roll(plane, -1, axis) for axis in range(plane.ndim)
    )


def near(found, expected, dtype):
    limit = 50 * ROUNDING[dtype] * np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=0, atol=limit)


@blocked
@every_precision
@every_case
def test_the_filter_of_wiener_solves_its_normal_equations(shape, sides, dtype):
    transfer = fourier.otf(uneven_psf(sides), shape, dtype)

    def filtered(plane):
        spectrum = fourier.forward(plane)
        wiener._filter(spectrum, transfer, shape, COUPLING)
        return fourier.inverse(spectrum, shape)

    linearity_test(filtered, shape, dtype, tolerance=50)
    blurred = vector(shape, 1, dtype)
    sharp = filtered(blurred)
    left = fourier.correlate(fourier.convolve(sharp, transfer), transfer)
    near(left + COUPLING * laplacian(sharp), fourier.correlate(blurred, transfer), dtype)


FILTERS = {
    "gradient": (fourier.laplacian_power, laplacian),
    "cosines": (local_shrinkage._power, lambda x: local_shrinkage.shrink(x, 0.0)),
}


@blocked
@every_precision
@every_case
@pytest.mark.parametrize(("power", "normal"), FILTERS.values(), ids=FILTERS)
def test_splitting_solves_its_least_squares(shape, sides, dtype, power, normal):
    psf, blurred, pull = uneven_psf(sides), vector(shape, 2, dtype), vector(shape, 3, dtype)
    transfer = fourier.otf(psf, shape, dtype)
    correlated = fourier.forward(fourier.correlate(blurred, transfer))
    known = tuple(max(side - 2, 1) for side in shape)
    sides_of_gap = drain(banding(known, blurred, psf, AT))
    data = Recorded(blurred, fourier.power(transfer), correlated, sides_of_gap)
    filters = partial(power, fourier.gradient_power(shape, blurred))
    sharp = drain(splitting.solving(data, pull.copy(), COUPLING, filters, (AT, AT)))
    left = fourier.correlate(fourier.convolve(sharp, transfer), transfer)
    right = fourier.correlate(blurred, transfer) + COUPLING * pull
    near(left + COUPLING * normal(sharp), right, dtype)


@every_precision
def test_the_loop_that_solves_is_the_same_operator(dtype):
    shape = (9, 14)
    spectrum, correlated = (fourier.forward(vector(shape, seed, dtype)) for seed in (4, 5))
    gain, power = (np.abs(vector((9, 8), seed, dtype)) + dtype(0.1) for seed in (6, 7))
    expected = (spectrum * COUPLING + correlated) / (gain + COUPLING * power)
    loops.solve(spectrum.view(dtype), correlated.view(dtype), gain, power, dtype(COUPLING))
    near(spectrum, expected, dtype)


@blocked
@every_precision
@every_case
def test_the_first_guess_of_reweighting_solves_its_equations(shape, sides, dtype):
    transfer, zeros = fourier.otf(uneven_psf(sides), shape, dtype), np.zeros(shape, dtype)
    blur = MaskedBlur(transfer, zeros, zeros, zeros > 1)

    def guessed(extended):
        return drain(irls._guessing(extended, blur, AT))

    linearity_test(guessed, shape, dtype, tolerance=50)
    blurred = vector(shape, 8, dtype)
    sharp = guessed(blurred)
    left = fourier.correlate(fourier.convolve(sharp, transfer), transfer)
    near(left + irls.SMOOTHING * laplacian(sharp), fourier.correlate(blurred, transfer), dtype)


@every_case
def test_with_even_weights_of_first_derivatives_the_preconditioner_is_the_inverse(shape, sides):
    transfer, zeros = fourier.otf(uneven_psf(sides), shape, np.float64), np.zeros(shape)
    blur = MaskedBlur(transfer, zeros, zeros, zeros > 1)
    weights = [zeros + 0.4 * (sum(each) == 1) for each in irls._derivatives(len(shape))]
    system, x = irls._System(blur, weights), vector(shape, 9)
    near(drain(system.preconditioning(drain(system.applying(x, AT)), AT)), x, np.float64)


@every_precision
@every_case
def test_inverse_filters_are_their_own_adjoints_where_the_blur_is_left_out(shape, sides, dtype):
    point = np.zeros(sides)
    point[tuple(side // 2 for side in sides)] = 1
    transfer = fourier.otf(point, shape, dtype)

    def filtered(plane):
        spectrum = fourier.forward(plane)
        wiener._filter(spectrum, transfer, shape, COUPLING)
        return fourier.inverse(spectrum, shape)

    dot_test(filtered, filtered, shape, shape, dtype)
