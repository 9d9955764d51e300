import numpy as np
import pytest

from napari_crfdeblur._typing import FloatArray
from napari_crfdeblur.psf import camera_shake, delta, disk, gaussian, kernel_a, kernel_b, line
from napari_crfdeblur.psf.shapes import render

SHAPES = {
    "delta": delta(),
    "line along a row": line(5, 0),
    "slanted line": line(14.3, 0.7),
    "line up": line(8, -1.9),
    "no line": line(0, 1),
    "disk": disk(3.3),
    "disk within a pixel": disk(0.2),
    "gaussian": gaussian(1.5),
    "A": kernel_a(),
    "B": kernel_b(),
    "shake": camera_shake(21, 3),
    "smallest shake": camera_shake(3, 1),
}


def moments(psf: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centroid relative to the center pixel, and covariance, in (row, column)."""
    at = np.indices(psf.shape).reshape(2, -1) - np.array(psf.shape)[:, None] // 2
    mean = at @ psf.ravel()
    return mean, (at * psf.ravel()) @ at.T - np.outer(mean, mean)


@pytest.mark.parametrize("psf", SHAPES.values(), ids=SHAPES)
def test_a_shape_is_a_centered_psf(psf: FloatArray) -> None:
    assert psf.dtype == np.float64
    assert all(side % 2 == 1 for side in psf.shape)
    assert psf.min() >= 0
    assert psf.sum() == pytest.approx(1, abs=1e-12)  # rounding
    np.testing.assert_allclose(moments(psf)[0], 0, atol=1e-12)


def test_a_line_points_from_the_column_axis_towards_the_row_axis() -> None:
    covariance = moments(line(20, 0.4))[1]
    assert 0.5 * np.arctan2(2 * covariance[0, 1], covariance[1, 1] - covariance[0, 0]) == (
        pytest.approx(0.4, abs=0.01)  # a pixel's own width is not rotated
    )


def test_a_line_covers_its_length() -> None:
    np.testing.assert_allclose(line(3, 0), [[0, 1 / 3, 1 / 3, 1 / 3, 0]], atol=0.05)
    # the variance of the segment, and what bilinear sharing adds: at most 1/4
    assert 0 <= moments(line(20, 0))[1][1, 1] - 20**2 / 12 <= 0.25


def test_a_disk_holds_the_area_that_it_covers() -> None:
    area = disk(3.3) * np.pi * 3.3**2
    assert area.max() == pytest.approx(1, abs=1e-3)  # strips of a 64th of a pixel
    # the square pixels of the rim are not spread evenly about its radius
    assert moments(disk(3.3))[1][0, 0] == pytest.approx(3.3**2 / 4 + 1 / 12, rel=0.01)


def test_a_gaussian_has_its_variance() -> None:
    # the pixel adds 1/12; the cut at 4 sigma takes a thousandth
    assert moments(gaussian(1.5))[1][1, 1] == pytest.approx(1.5**2 + 1 / 12, rel=2e-3)


@pytest.mark.parametrize("psf", [kernel_b(), camera_shake(21, 3)], ids=["B", "shake"])
def test_an_uneven_motion_is_no_mirror_image_of_itself(psf: FloatArray) -> None:
    assert np.abs(psf - psf[::-1, ::-1]).sum() > 0.5


def test_a_shake_repeats_and_fills_its_array() -> None:
    first, other = camera_shake(15, 1), camera_shake(15, 2)
    np.testing.assert_array_equal(first, camera_shake(15, 1))
    assert first.shape == (15, 15)
    assert not np.allclose(first, other)
    border = np.concatenate([first[0], first[-1], first[:, 0], first[:, -1]])
    assert border.any()


def test_a_path_keeps_its_sub_pixel_centroid() -> None:
    psf = render(np.array([[0.0, 0.0], [0.0, 2.5]]), np.array([1.0, 3.0]))
    np.testing.assert_allclose(moments(psf)[0], 0, atol=1e-12)
    assert moments(psf)[1][1, 1] >= 3 / 16 * 2.5**2


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: line(-1, 0),
        lambda: line(3, np.nan),
        lambda: disk(0),
        lambda: gaussian(-1),
        lambda: camera_shake(4, 0),
        lambda: camera_shake(1, 0),
    ],
)
def test_impossible_shapes_are_refused(wrong) -> None:
    with pytest.raises(ValueError, match="expected"):
        wrong()
