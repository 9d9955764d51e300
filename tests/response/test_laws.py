"""What holds for every camera response."""

from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest

from napari_crfdeblur.response import (
    SRGB,
    Emor,
    Gamma,
    GeneralizedGamma,
    Identity,
    Polynomial,
    ResponseCurve,
    Tabulated,
    Tuned,
    dorf_mean,
    monotone,
)

CURVES: list[ResponseCurve] = [
    Identity(),
    Gamma(2.2),
    Gamma(0.6),
    SRGB(),
    Polynomial((0.3, 0.1, 0.6)),
    Polynomial((0.2, -0.1, 0.5, 0.1, 0.3)),
    GeneralizedGamma((0.45, 0.1)),
    GeneralizedGamma((0.6, -0.3, 0.2)),
    Tabulated(np.array([0, 0.1, 0.5, 1]), np.array([0, 0.35, 0.8, 1])),
    dorf_mean(),
    Emor((1.5, -0.6, 0.1)),
    Emor((-1.0, 0.4)),
    Tuned(SRGB(), gamma=1.3),
    Tuned(Gamma(2.2), (0.5, -0.2), 0.8),
    Tuned(Tabulated(np.array([0, 0.1, 0.5, 1]), np.array([0, 0.35, 0.8, 1])), (-0.4,)),
]
GRID = np.linspace(0, 1, 1001).reshape(7, 143)
each_curve = pytest.mark.parametrize("curve", CURVES, ids=repr)


@each_curve
def test_inverse_undoes_the_response(curve):
    # Where the response is flat, f(E) carries E with fewer digits.
    np.testing.assert_allclose(curve.to_irradiance(curve.to_intensity(GRID)), GRID, atol=1e-11)


@each_curve
def test_response_undoes_the_inverse(curve):
    # Intensities whose irradiance is below 1e-8 are steep: a gamma turns 1e-16 into 1e-7.
    seen = GRID[curve.to_irradiance(GRID) > 1e-8]
    np.testing.assert_allclose(curve.to_intensity(curve.to_irradiance(seen)), seen, atol=1e-11)


BY_NEWTON = [c for c in CURVES if isinstance(c, Polynomial | GeneralizedGamma)]
each_by_newton = pytest.mark.parametrize("curve", BY_NEWTON, ids=repr)


@each_by_newton
def test_iteration_is_exact_in_the_dark_too(curve):
    irradiance = np.geomspace(1e-19, 1, 5001)
    seen = curve.to_intensity(irradiance)
    # A few roundings of the formula itself.
    np.testing.assert_allclose(curve.to_irradiance(seen), irradiance, rtol=2e-14)
    assert np.all(np.diff(seen) > 0)


@each_by_newton
def test_iteration_ends_once_it_has_converged(curve, monkeypatch):
    evaluated = []
    inverse = type(curve)._inverse

    def counted(self, intensity):
        evaluated.append(np.size(intensity))
        return inverse(self, intensity)

    monkeypatch.setattr(type(curve), "_inverse", counted)
    curve.to_intensity(np.linspace(0, 1, 10001))
    # measured: 6 steps, 4.5 for each value
    assert sum(evaluated) < 7 * 10001
    assert len(evaluated) < 12


@each_curve
def test_ends_are_fixed_in_both_directions(curve):
    np.testing.assert_array_equal(curve.to_intensity([0, 1]), [0, 1])
    np.testing.assert_array_equal(curve.to_irradiance([0, 1]), [0, 1])


@each_curve
def test_both_directions_increase_strictly(curve):
    assert np.all(np.diff(curve.to_intensity(GRID.ravel())) > 0)
    assert np.all(np.diff(curve.to_irradiance(GRID.ravel())) > 0)


@each_curve
def test_slope_is_the_finite_difference(curve):
    # Between the joints of the 1024-sample tables; a step of 1e-7 leaves 9 digits.
    irradiance = (np.arange(40, 1000, 37) + 0.5) / 1023
    away = np.abs(irradiance - 0.0031306684425) > 1e-6
    h = 1e-7
    difference = curve.to_intensity(irradiance + h) - curve.to_intensity(irradiance - h)
    np.testing.assert_allclose(curve.slope(irradiance)[away], difference[away] / (2 * h), rtol=1e-5)


@each_curve
def test_values_outside_are_clipped(curve):
    np.testing.assert_array_equal(curve.to_intensity([-0.5, 1.5]), [0, 1])
    np.testing.assert_array_equal(curve.to_irradiance([-0.5, 1.5]), [0, 1])


@each_curve
def test_shape_is_kept_and_results_are_float64(curve):
    for image in (GRID.astype(np.float32), GRID[:3, :5]):
        for result in (curve.to_intensity(image), curve.to_irradiance(image)):
            assert result.shape == image.shape
            assert result.dtype == np.float64


@each_curve
def test_input_is_not_modified(curve):
    image = GRID.copy()
    curve.to_intensity(image)
    curve.to_irradiance(image)
    curve.slope(image)
    np.testing.assert_array_equal(image, GRID)


@pytest.mark.parametrize(
    "make",
    [
        Identity,
        SRGB,
        lambda: Gamma(1.8),
        lambda: Polynomial((0.5, 0.5)),
        lambda: GeneralizedGamma((0.5,)),
        lambda: Emor((0.2, 0.1)),
        lambda: Tuned(SRGB(), (0.2, 0.1), 1.1),
    ],
    ids=["identity", "srgb", "gamma", "polynomial", "generalized gamma", "emor", "tuned"],
)
def test_curves_given_by_numbers_compare_and_hash_by_them(make):
    assert make() == make()
    assert hash(make()) == hash(make())


@each_curve
def test_fields_cannot_be_reassigned(curve):
    for field in fields(curve):
        with pytest.raises(FrozenInstanceError):
            setattr(curve, field.name, None)


def test_monotone_leaves_a_clearly_rising_curve_nearly_alone():
    intensity = np.linspace(0, 1, 50)
    curve = monotone(intensity, 3 * intensity**2 + 7)  # any scale and offset
    # A slope of a thousandth is added everywhere.
    np.testing.assert_allclose(curve.to_irradiance(intensity), intensity**2, atol=1e-3)


def test_monotone_repairs_samples_that_fall():
    intensity = np.linspace(0, 1, 60)
    irradiance = intensity**2 + 0.05 * np.sin(40 * intensity)
    curve = monotone(intensity, irradiance)
    assert np.all(np.diff(curve.irradiance) > 0)
    assert np.abs(curve.irradiance - intensity**2).max() < 0.15
