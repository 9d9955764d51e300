"""What lies beyond the border: continued, blurred into, seen from, each with its adjoint."""

import numpy as np
import pytest
from adjoints import AT, PRECISIONS, ROUNDING, dot_test, linearity_test, uneven_psf, vector

from napari_crfdeblur import boundary, fourier
from napari_crfdeblur.boundary import Band, banding, extend, frame, periodic_shape
from napari_crfdeblur.deconvolution.recorded import BorderedBlur, MaskedBlur, Recorded
from napari_crfdeblur.deconvolution.share import share_inside, share_of
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf.blind.edge_prediction import EdgePredictor

# Pictures and PSFs: bands much narrower than the picture, as wide, and no gap along an axis.
CASES = [
    ((40, 51), (5, 3)),
    ((60, 33), (4, 7)),
    ((9, 30), (9, 1)),
    ((7, 5), (6, 5)),
    ((1, 30), (1, 4)),
    ((12, 13, 25), (3, 5, 2)),
]
every_case = pytest.mark.parametrize(("shape", "sides"), CASES)
every_precision = pytest.mark.parametrize("dtype", PRECISIONS)


def bands(shape, psf, dtype):
    whole = np.zeros(periodic_shape(shape, psf.shape), dtype)
    return drain(banding(shape, whole, psf, AT))


@every_case
def test_the_bands_hold_every_pixel_of_the_gap_once(shape, sides):
    psf = uneven_psf(sides)
    count = np.zeros(periodic_shape(shape, sides))
    for band in bands(shape, psf, np.float64):
        band.gap_of(count)[...] += 1
    assert not count[frame(shape)].any()
    count[frame(shape)] = 1
    np.testing.assert_array_equal(count, 1)


@every_precision
@every_case
def test_gathering_from_the_gap_is_the_adjoint_of_blurring_into_it(shape, sides, dtype):
    psf, period = uneven_psf(sides), periodic_shape(shape, sides)
    for band in bands(shape, psf, dtype):

        def gathered(values, band=band):
            scene = np.zeros(period, dtype)
            drain(band.gathering(values, scene, AT))
            return scene

        gap = band.gap_of(np.zeros(period)).shape
        dot_test(lambda x, b=band: drain(b.blurring(x, AT)), gathered, period, gap, dtype)


@every_case
def test_bands_blur_as_the_whole_does(shape, sides):
    psf, period = uneven_psf(sides), periodic_shape(shape, sides)
    transfer, scene = fourier.otf(psf, period, np.float64), vector(period, 1)
    values, found = vector(period, 2), vector(period, 3)
    values[frame(shape)] = 0
    expected = found + fourier.correlate(values, transfer)
    for band in bands(shape, psf, np.float64):
        np.testing.assert_allclose(
            drain(band.blurring(scene, AT)),
            band.gap_of(fourier.convolve(scene, transfer)),
            atol=1e-13,
        )
        drain(band.gathering(band.gap_of(values), found, AT))
    np.testing.assert_allclose(found, expected, atol=1e-13)


@every_case
def test_a_band_is_no_larger_than_the_picture(shape, sides):
    psf, period = uneven_psf(sides), periodic_shape(shape, sides)
    for axis in range(len(shape)):
        if period[axis] > shape[axis]:
            band = Band(axis, shape, np.zeros(period), psf)
            assert band.band.size <= np.prod(period)


@every_precision
@every_case
def test_continuing_keeps_the_picture_and_follows_its_scale(shape, sides, dtype):
    psf, plane = uneven_psf(sides), vector(shape, 4, dtype)
    extended = extend(plane, psf)
    np.testing.assert_array_equal(extended[frame(shape)], plane)
    # by a power of two, which rounds nothing: the same steps, to the last bit
    np.testing.assert_array_equal(extend(-4 * plane, psf), -4 * extended)


@every_case
def test_the_operator_behind_the_continuation_is_a_contraction_that_keeps_the_mean(shape, sides):
    psf, period = uneven_psf(sides), periodic_shape(shape, sides)
    gain = boundary._blur_of_deblurred(psf, np.zeros(period))
    assert gain.min() >= 0
    assert gain.max() <= 1
    assert gain.flat[0] == 1
    np.testing.assert_array_less(gain.flat[1:], 1)

    def smoothed(x):
        return fourier.inverse(gain * fourier.forward(x), period)

    dot_test(smoothed, smoothed, period, period)


def blurs(shape, psf, dtype, clipped=None):
    """The blur with a mask by bands, where all was recorded, or by the mask itself."""
    period = periodic_shape(shape, psf.shape)
    transfer = fourier.otf(psf, period, dtype)
    if clipped is None:
        return BorderedBlur(transfer, shape, bands(shape, psf, dtype))
    return MaskedBlur(transfer, np.zeros(period, dtype), np.zeros(shape, dtype), clipped)


def a_fifth(shape):
    """Which pixels are clipped."""
    return vector(shape, 5) > 0.8


@every_precision
@every_case
@pytest.mark.parametrize("masked", [False, True])
def test_back_and_forth_is_blur_mask_and_adjoint(shape, sides, dtype, masked):
    psf, period = uneven_psf(sides), periodic_shape(shape, sides)
    clipped = a_fifth(shape) if masked else None
    blur = blurs(shape, psf, dtype, clipped)

    def applied(x):
        return drain(blur.back_and_forth(x, AT))

    dot_test(applied, applied, period, period, dtype)
    linearity_test(applied, period, dtype)
    kept = np.zeros(period, dtype)
    kept[frame(shape)] = 1 if clipped is None else ~clipped
    transfer, x = fourier.otf(psf, period, dtype), vector(period, 6, dtype)
    expected = fourier.correlate(kept * fourier.convolve(x, transfer), transfer)
    limit = 10 * ROUNDING[dtype] * np.abs(x).max()
    np.testing.assert_allclose(applied(x), expected, rtol=0, atol=limit)


@every_precision
@every_case
def test_what_was_recorded_goes_back_by_the_adjoint_of_masked_blur(shape, sides, dtype):
    psf, period = uneven_psf(sides), periodic_shape(shape, sides)
    transfer, clipped = fourier.otf(psf, period, dtype), a_fifth(shape)

    def back_from_frame(y):
        light = vector(period, 7, dtype)  # whatever the gap holds
        light[frame(shape)] = y
        return drain(blurs(shape, psf, dtype).reversing(light, AT))

    def back_from_mask(y):
        blur = MaskedBlur(transfer, np.zeros(period, dtype), y, clipped)
        return drain(blur.reversing(y, AT))

    def seen(x):
        return fourier.convolve(x, transfer)[frame(shape)].copy()

    dot_test(seen, back_from_frame, period, shape, dtype)
    dot_test(lambda x: ~clipped * seen(x), back_from_mask, period, shape, dtype)


@every_case
def test_completing_adds_what_the_correlation_lacks_of_the_filled_gap(shape, sides):
    psf, period = uneven_psf(sides), periodic_shape(shape, sides)
    transfer, extended = fourier.otf(psf, period, np.float64), vector(period, 8)
    spectrum = fourier.forward(extended)
    fourier.multiply_conjugate(spectrum, transfer)
    data = Recorded(extended, fourier.power(transfer), spectrum, bands(shape, psf, np.float64))
    for seed in (9, 10):
        drain(data.filling(vector(period, seed), AT))
    found = fourier.inverse(spectrum.copy(), period)
    drain(data.completing(found, 1.0, AT))
    filled = extended.copy()
    for band, change in zip(data.bands, data.change, strict=True):
        band.gap_of(filled)[...] += change
    np.testing.assert_allclose(found, fourier.correlate(filled, transfer), atol=1e-12)
    np.testing.assert_array_equal(filled[frame(shape)], extended[frame(shape)])


@every_case
def test_the_share_of_light_is_the_adjoint_of_counting_what_was_recorded(shape, sides):
    psf, period = uneven_psf(sides), periodic_shape(shape, sides)
    transfer, free = fourier.otf(psf, period, np.float64), a_fifth(shape)
    scene = np.abs(vector(period, 11))
    blurred = fourier.convolve(scene, transfer)[frame(shape)]
    whole = share_inside(psf, np.zeros(shape))
    some = drain(share_of(1.0 * ~free, transfer, period, AT))
    for share, recorded in ((whole, blurred.sum()), (some, blurred[~free].sum())):
        seen = share > 0
        total = (scene[seen] / share[seen]).sum()
        # what is hardly seen, less than a thousandth of a pixel's light, is not counted
        assert 0 <= recorded - total + 1e-9 <= 1e-3 * scene[~seen].sum() + 2e-9


@every_precision
@pytest.mark.parametrize(("shape", "size"), [((20, 33), 5), ((31, 14), 7), ((9, 11), 9)])
def test_closing_a_picture_is_linear_and_keeps_it_and_a_constant(shape, size, dtype):
    def closed(x):
        return EdgePredictor.of(x, size).periodic

    linearity_test(closed, shape, dtype)
    plane = vector(shape, 12, dtype)
    np.testing.assert_array_equal(closed(plane)[frame(shape)], plane)
    np.testing.assert_allclose(closed(np.full(shape, 0.3, dtype)), 0.3, rtol=1e-6)
    assert all(n >= m + 2 * size for n, m in zip(closed(plane).shape, shape, strict=True))
