"""Linearize and reapply undo each other, for every kind of photo and of response."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image as Pillow

from napari_crfdeblur.progress import Progress, drain
from napari_crfdeblur.response import (
    SRGB,
    Emor,
    Gamma,
    GeneralizedGamma,
    Identity,
    Polynomial,
    Tabulated,
    clipped_pixels,
    dorf_mean,
    linearize,
    linearizing,
    reapply,
    reapplying,
)
from napari_crfdeblur.response.linear import BLOCK

CURVES = [
    Identity(),
    Gamma(2.2),
    Gamma(0.6),
    SRGB(),
    Polynomial((0.2, -0.1, 0.5, 0.1, 0.3)),
    GeneralizedGamma((0.6, -0.3, 0.2)),
    dorf_mean(),
    Emor((1.5, -0.6, 0.1)),
]
KINKED = Tabulated(np.array([0, 0.1, 0.5, 1]), np.array([0, 0.35, 0.8, 1]))
each_curve = pytest.mark.parametrize("curve", CURVES, ids=lambda c: type(c).__name__)
each_kind = pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
SHAPES = [(8, 32), (7, 13), (5, 9, 3), (3, 5, 4), (1, 1)]
RNG = np.random.default_rng(8)


def photo_of(dtype, shape=(23, 37, 3)):
    light = np.random.default_rng(1).random(shape)
    light.flat[:2] = 0, 1
    top = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    return np.rint(light * top).astype(dtype) if top > 1 else light.astype(dtype)


@each_curve
def test_every_level_of_8_bit_comes_back(curve):
    photo = np.arange(256, dtype=np.uint8).reshape(8, 32)
    np.testing.assert_array_equal(reapply(linearize(photo, curve), curve, np.uint8), photo)


@each_curve
def test_every_level_of_16_bit_comes_back_within_one(curve):
    photo = np.arange(65536, dtype=np.uint16).reshape(128, 512)
    back = reapply(linearize(photo, curve), curve, np.uint16).astype(int)
    # Light is kept as float32, in which a steep curve cannot tell neighboring levels.
    assert np.abs(back - photo.astype(int)).max() <= 1


@each_curve
@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float32, 2e-6), (np.float64, 1e-11)])
def test_floats_come_back(curve, dtype, tolerance):
    photo = np.linspace(0, 1, 2000).reshape(40, 50).astype(dtype)
    back = reapply(linearize(photo, curve), curve, dtype)
    assert back.dtype == dtype
    # float32: straight lines between knots a 1024th apart, twice, and the rounding of light.
    seen = (photo == 0) | (curve.to_irradiance(photo) > 1e-8)
    np.testing.assert_allclose(back[seen], photo[seen], atol=tolerance)


@each_kind
def test_straight_lines_cut_a_kink_short_by_less_than_a_tenth_of_a_level(dtype):
    levels = np.arange(65536) if dtype is np.uint16 else np.arange(256)
    photo = (levels / (1 if np.dtype(dtype).kind == "u" else levels[-1])).astype(dtype)
    photo = photo.reshape(8, -1)
    back = reapply(linearize(photo, KINKED), KINKED, dtype)
    # A knot's cell of 2^-11, times a quarter of the change of slope of 1.6, is 2e-4; of this,
    # 8 bit sees nothing.
    full = np.iinfo(dtype).max if photo.dtype.kind == "u" else 1
    tolerance = 0 if dtype is np.uint8 else 3e-4 * full
    np.testing.assert_allclose(back.astype(float), photo.astype(float), atol=tolerance)


@each_curve
@each_kind
def test_light_is_that_of_the_curve(curve, dtype):
    photo = photo_of(dtype)
    top = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    linear = linearize(photo, curve)
    assert linear.dtype == (np.float64 if dtype is np.float64 else np.float32)
    # 1e-6 where straight lines stand for the curve and float32 for the light.
    np.testing.assert_allclose(linear, curve.to_irradiance(photo / top), rtol=1e-6, atol=1e-6)


@each_curve
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_recorded_light_is_that_of_the_curve_within_a_level(curve, dtype):
    light = RNG.random((31, 45)).astype(np.float32) ** 3
    expected = curve.to_intensity(light) * np.iinfo(dtype).max
    recorded = reapply(light, curve, dtype)
    assert recorded.dtype == dtype
    # Half a level of rounding, and the share of a level that the table leaves open.
    assert np.abs(recorded - expected).max() < (0.6 if dtype is np.uint8 else 1.0)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
@each_kind
def test_any_shape_is_kept(shape, dtype):
    photo = photo_of(dtype, shape) if np.prod(shape) > 1 else np.ones(shape, dtype)
    linear = linearize(photo, SRGB())
    assert linear.shape == shape
    back = reapply(linear, SRGB(), dtype)
    # For float32 as above; uint16 within a level.
    np.testing.assert_allclose(
        back.astype(float), photo, atol=2e-6 if photo.dtype.kind == "f" else 1
    )


@each_kind
def test_each_channel_has_its_own_curve(dtype):
    photo = photo_of(dtype)
    own = [Gamma(1.4), Identity(), SRGB()]
    linear = linearize(photo, own)
    for channel, curve in enumerate(own):
        alone = np.ascontiguousarray(photo[..., channel])
        np.testing.assert_array_equal(linear[..., channel], linearize(alone, curve))
        back = reapply(linear, own, dtype)[..., channel]
        np.testing.assert_array_equal(back, reapply(linearize(alone, curve), curve, dtype))


def test_one_curve_in_a_list_serves_a_gray_photo():
    photo = photo_of(np.uint8, (9, 14))
    np.testing.assert_array_equal(linearize(photo, [SRGB()]), linearize(photo, SRGB()))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_values_outside_the_range_are_clipped(dtype):
    wild = np.array([[-np.inf, -3, -1e-30, -0.0, 0, 1, 1.5, np.inf]], dtype=dtype)
    expected = [[0, 0, 0, 0, 0, 1, 1, 1]]
    np.testing.assert_array_equal(linearize(wild, SRGB()), expected)
    for kind, top in ((np.uint8, 255), (np.uint16, 65535), (np.float32, 1), (np.float64, 1)):
        recorded = reapply(wild, Gamma(2.2), kind)
        assert recorded.dtype == kind
        np.testing.assert_array_equal(recorded, np.array(expected) * top)


@each_kind
def test_strided_photos_are_those_of_their_copies(dtype):
    whole = photo_of(dtype)
    odd = whole.reshape(-1)[1:].view()[: 22 * 37 * 3].reshape(22, 37, 3)  # starts off a word
    for view in (whole[::-1, ::2], whole.transpose(1, 0, 2), whole[:, :, 1], odd):
        copy = np.ascontiguousarray(view)
        linear = linearize(view, dorf_mean())
        np.testing.assert_array_equal(linear, linearize(copy, dorf_mean()))
        back = reapply(linear[::2, ::-1], dorf_mean(), dtype)
        np.testing.assert_array_equal(back, reapply(linear[::2, ::-1].copy(), dorf_mean(), dtype))


@each_kind
def test_the_input_stays_as_it_is(dtype):
    photo = photo_of(dtype)
    before = photo.copy()
    photo.setflags(write=False)
    linear = linearize(photo, [SRGB()] * 3)
    np.testing.assert_array_equal(photo, before)
    kept = linear.copy()
    linear.setflags(write=False)
    reapply(linear, Identity(), dtype)
    np.testing.assert_array_equal(linear, kept)
    assert not np.shares_memory(linearize(photo, Identity()), photo)


def test_float64_is_worked_on_in_float64():
    photo = np.linspace(0, 1, 56).reshape(7, 8)
    np.testing.assert_array_equal(linearize(photo, SRGB()), SRGB().to_irradiance(photo))
    exact = reapply(photo, SRGB(), np.float64)
    np.testing.assert_array_equal(exact, SRGB().to_intensity(photo))


def test_more_than_a_block_of_pixels_is_worked_on_to_its_end():
    photo = photo_of(np.uint8, (257, 511))  # two blocks and an odd rest
    linear = linearize(photo, SRGB())
    np.testing.assert_array_equal(linear[-1], linearize(photo[-1:], SRGB())[0])
    np.testing.assert_array_equal(reapply(linear, SRGB(), np.uint8), photo)


@pytest.mark.parametrize("curve", [SRGB(), [Gamma(1.4), Identity(), SRGB()]], ids=["one", "each"])
@each_kind
def test_the_jobs_count_every_block_and_give_what_the_verbs_do(curve, dtype):
    photo = photo_of(dtype, (211, 301, 3))
    seen: list[Progress] = []
    linear = drain(linearizing(photo, curve), seen.append)
    np.testing.assert_array_equal(linear, linearize(photo, curve))
    reports = len(seen)
    recorded = drain(reapplying(linear, curve, dtype), seen.append)
    np.testing.assert_array_equal(recorded, reapply(linear, curve, dtype))
    for each in (seen[:reports], seen[reports:]):
        assert len({(report.stage, report.total) for report in each}) == 1
        assert [report.done for report in each] == list(range(each[0].total + 1))
        assert each[0].total >= photo.size / BLOCK


def test_a_closed_job_stops():
    job = linearizing(photo_of(np.uint8), SRGB())
    next(job)
    job.close()
    with pytest.raises(StopIteration):
        next(job)


@pytest.mark.parametrize("count", [0, 1, 2, 4])
def test_another_number_of_curves_than_of_channels_is_refused(count):
    with pytest.raises(ValueError, match=f"3, one for each channel, got {count}"):
        linearize(photo_of(np.uint8), [SRGB()] * count)
    with pytest.raises(ValueError, match=f"3, one for each channel, got {count}"):
        reapply(photo_of(np.float32), [SRGB()] * count)


@pytest.mark.parametrize(
    "wrong",
    [np.zeros(5), np.zeros((4, 5, 2)), np.zeros((4, 5, 3, 1)), np.zeros((4, 5), dtype=np.int32)],
    ids=lambda w: f"{w.dtype} {w.shape}",
)
def test_what_is_no_image_is_refused(wrong):
    with pytest.raises(ValueError, match="expected an image"):
        linearize(wrong, SRGB())
    with pytest.raises(ValueError, match="expected an image"):
        reapply(wrong, SRGB())


@each_kind
def test_clipped_pixels_are_those_at_the_top_channel_by_channel(dtype):
    photo = photo_of(dtype) // 2 if np.dtype(dtype).kind == "u" else photo_of(dtype) / 2
    top = np.iinfo(dtype).max if photo.dtype.kind == "u" else 1
    photo[4:6, 7, 0] = photo[20, 30, 2] = top
    photo[1, 1, 1] = round(0.992 * top) if top > 1 else 0.992  # as JPEG scatters
    photo[1, 2, 1] = round(0.97 * top) if top > 1 else 0.97
    clipped = clipped_pixels(photo)
    assert clipped.dtype == bool
    assert clipped.shape == photo.shape
    assert set(zip(*np.nonzero(clipped), strict=True)) == {
        (1, 1, 1),
        (4, 7, 0),
        (5, 7, 0),
        (20, 30, 2),
    }
    assert clipped_pixels(photo, scatter=0).sum() == 3
    assert clipped_pixels(photo, level=0.97).sum() == 5


def test_saturated_pixels_are_found_again_after_jpeg():
    light = np.tile(np.linspace(0.2, 1.6, 120), (90, 1))
    photo = np.stack([np.rint(255 * np.clip(light, 0, 1)).astype(np.uint8)] * 3, axis=2)
    file = BytesIO()
    Pillow.fromarray(photo).save(file, "JPEG", quality=85)
    compressed = np.asarray(Pillow.open(BytesIO(file.getvalue())))
    truth = light >= 1
    found = clipped_pixels(compressed)[..., 1]
    # beside the edge, a pixel or two of the slope are within three levels of the top
    assert found[truth].mean() > 0.99
    assert found[~truth].mean() < 0.03


@pytest.mark.parametrize(("level", "scatter"), [(0, 0), (1.2, 0), (1, 1), (0.5, -0.1)])
def test_a_range_that_is_none_is_refused(level, scatter):
    with pytest.raises(ValueError, match=r"expected a (level|scatter)"):
        clipped_pixels(photo_of(np.uint8), level=level, scatter=scatter)
