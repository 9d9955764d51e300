"""Pictures of a photo: reduced, smoothed, and between its pixels."""

import numpy as np
import pytest
from scipy import ndimage

from napari_crfdeblur.edges.picture import Picture
from napari_crfdeblur.edges.sampling import Grids, interpolated
from napari_crfdeblur.edges.segments import gaussian_smoothed

KINDS = [np.uint8, np.uint16, np.float16, np.float32, np.float64]


def photo_of(kind, shape=(61, 83, 3)):
    unit = np.random.default_rng(2).uniform(0.5, 1, shape)  # bright: sums grow large
    full = np.iinfo(kind).max if np.dtype(kind).kind == "u" else 1
    return (unit * full).astype(kind)


def points(grids):
    """Rows and columns of the points of grids, (2, K, T, D)."""
    s, c = grids.normal[:, 0, None, None], grids.normal[:, 1, None, None]
    along, across = grids.along[:, :, None], grids.across
    center = grids.center[:, :, None, None]
    return np.stack([center[:, 0] - along * c + across * s, center[:, 1] + along * s + across * c])


def turned_grids(centers, size=9.0):
    angle = np.linspace(0.1, 3.0, len(centers))
    along = np.linspace(-size, size, 14) * np.linspace(0.8, 1.3, len(centers))[:, None]
    normal = np.stack([np.sin(angle), np.cos(angle)], axis=1)
    return Grids(np.array(centers, dtype=float), normal, along, np.arange(-6.0, 7.0))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("step", [2, 3, 7, 20])
def test_a_reduced_picture_has_the_means_over_squares(kind, step):
    photo = photo_of(kind)
    picture = Picture.of(photo).reduced(step)
    rows, columns = 61 // step, 83 // step
    unit = photo[: rows * step, : columns * step] * Picture.of(photo).unit
    squares = unit.astype(float).reshape(rows, step, columns, step, 3).mean(axis=(1, 3))
    # Sums of float16 and of float32 values round to single precision.
    assert np.allclose(np.stack(picture.planes(), axis=-1), squares, atol=1e-3)
    assert picture.step == step


def test_alpha_and_the_order_in_memory_do_not_matter():
    photo = photo_of(np.uint8)
    alpha = np.concatenate([photo, photo[..., :1]], axis=2)
    others = [alpha, np.asfortranarray(photo), photo[::-1, ::-1][::-1, ::-1]]
    grids = turned_grids([(30.2, 40.7)])
    for other in others:
        for step in (1, 3):
            pictures = [Picture.of(p).reduced(step) for p in (photo, other)]
            assert np.array_equal(pictures[0].planes(), pictures[1].planes())
        assert np.array_equal(
            interpolated(Picture.of(photo), grids), interpolated(Picture.of(other), grids)
        )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "centers",
    [[(30.2, 40.7), (25.5, 51.1)], [(2.3, 40.0), (58.9, 81.2), (30.0, -3.0)], [(-300.0, 5000.0)]],
)
def test_between_pixels_a_picture_is_bilinear_and_beyond_it_unknown(kind, centers):
    photo, grids = photo_of(kind), turned_grids(centers)
    picture = Picture.of(photo)
    found = interpolated(picture, grids)
    for channel, values in enumerate(found):
        plane = photo[..., channel].astype(float) * picture.unit
        expected = ndimage.map_coordinates(
            plane, points(grids), order=1, mode="constant", cval=np.nan
        )
        # Places are kept in single precision, to less than a thousandth of a pixel.
        assert np.allclose(values, expected, atol=1e-4, equal_nan=True)


@pytest.mark.parametrize("shape", [(1, 9), (9, 1), (1, 1), (2, 2)])
def test_a_tiny_picture_has_values_too(shape):
    picture = Picture.of(np.full(shape, 0.25))
    middle = np.array([[0.0, 0.0]])
    grids = Grids(middle, np.array([[0.0, 1.0]]), np.array([[-1.0, 0.0]]), np.array([0.0, 20.0]))
    assert interpolated(picture, grids)[0, 0, 1, 0] == 0.25
    assert np.isnan(interpolated(picture, grids)[0, 0, :, 1]).all()


@pytest.mark.parametrize("sigma", [0.8, 2.3])
def test_a_smoothed_plane_is_that_of_a_gaussian_filter(sigma):
    plane = photo_of(np.float32)[..., 0]
    expected = ndimage.gaussian_filter(plane, sigma, mode="nearest", truncate=3)
    # Rounding of sums of some 10 single-precision values.
    assert np.allclose(gaussian_smoothed(plane, sigma)[1:-1, 1:-1], expected, atol=1e-6)
