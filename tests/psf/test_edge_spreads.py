import numpy as np
import pytest

from napari_crfdeblur.profiles import ProfileGroup, ProfileSource
from napari_crfdeblur.psf import camera_shake, project
from napari_crfdeblur.psf.projection import project_pixel
from napari_crfdeblur.psf.radon.edge_spreads import linearized
from napari_crfdeblur.psf.radon.spread_fit import Placed, pixel_density
from napari_crfdeblur.response import Gamma

SHAKE = camera_shake(9, 3)
POSITION = np.arange(-16, 17) / 2


def group(place: float, angle: float = 0.7) -> ProfileGroup:
    """A rising and a falling profile of a known response, `place` pixels beside the middle."""
    sides = np.array([[0.1, 0.8], [0.9, 0.3]])
    light = sides[:, :1] + np.diff(sides) * project(SHAKE, angle, POSITION - place)
    return ProfileGroup(
        position=POSITION,
        intensity=Gamma(2.0).to_intensity(light),
        variance=np.full(light.shape, 1e-5),
        count=np.ones(light.shape),
        sides=Gamma(2.0).to_intensity(sides),
        sides_variance=np.full((2, 2), 1e-6),
        orientation=angle,
        polarity=0,
        sources=(ProfileSource(0, 0, 0), ProfileSource(0, 1, 0)),
    )


def test_spreads_of_either_polarity_are_the_projection_of_the_psf() -> None:
    (found,) = linearized([group(0.4)], Gamma(2.0))
    expected = project(SHAKE, 0.7, POSITION - 0.4)
    np.testing.assert_allclose(found.spread, np.stack([expected] * 2), atol=1e-9)  # rounding


def test_the_middle_is_where_the_centroid_lies() -> None:
    offsets = np.indices(SHAKE.shape) - np.array(SHAKE.shape)[:, np.newaxis, np.newaxis] // 2
    (found,) = linearized([group(0.4)], Gamma(2.0))
    centroid = (SHAKE * offsets).sum(axis=(1, 2)) @ found.normal
    assert found.middle == pytest.approx(0.4 + centroid, abs=0.01)  # sum for the integral


def test_variances_are_those_of_light() -> None:
    (found,) = linearized([group(0.0)], Gamma(2.0))
    # E = I^2: dE/dI = 2 I, over the contrast of the profile
    intensity = group(0.0).intensity[0, -1]
    expected = (1e-5 + 1e-6) * (2 * intensity / 0.7) ** 2 + 1e-4
    assert found.variance[0, -1] == pytest.approx(expected)


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4, 2.0])
def test_the_density_is_the_slope_of_the_projected_pixel(angle: float) -> None:
    normal = np.array([np.sin(angle), np.cos(angle)])
    x = np.linspace(-1, 1, 4001)
    rise = np.cumsum(pixel_density(x, normal)) * (x[1] - x[0])
    # a sum in place of an integral, at steps of a 2000th
    np.testing.assert_allclose(rise, project_pixel(x, normal), atol=1e-3)


def test_profiles_settle_where_the_shape_fits() -> None:
    (found,) = linearized([group(0.3)], Gamma(2.0))
    placed = Placed.of(found)
    projection = placed.projection(9)
    for _ in range(4):
        placed = placed.settled(projection.shape(SHAKE.ravel())).recentered()
        projection = placed.projection(9)
    assert placed.origin == pytest.approx(0.3, abs=1e-6)
    assert placed.misfit(projection.shape(SHAKE.ravel())).max() < 1e-6
