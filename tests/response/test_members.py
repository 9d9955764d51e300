"""What holds for single responses, and what they refuse."""

import numpy as np
import pytest

from napari_crfdeblur.response import (
    SRGB,
    Emor,
    Gamma,
    GeneralizedGamma,
    Polynomial,
    Tabulated,
    dorf_mean,
    emor_table,
    monotone,
)


def test_emor_without_coefficients_is_the_mean_of_the_table():
    irradiance = np.linspace(0, 1, 1024)
    np.testing.assert_allclose(Emor().to_intensity(irradiance), emor_table()[0], atol=1e-15)
    assert dorf_mean() == Emor()


def test_emor_adds_its_basis_curves():
    irradiance, table = np.linspace(0, 1, 1024), emor_table()
    expected = table[0] + 0.7 * table[1] - 0.3 * table[2]
    np.testing.assert_allclose(Emor((0.7, -0.3)).to_intensity(irradiance), expected, atol=1e-15)


def test_emor_basis_is_orthonormal():
    basis = emor_table()[1:]
    # The published table has about 7 digits; the ends are set to exactly 0.
    np.testing.assert_allclose(basis @ basis.T, np.eye(25), atol=1e-3)


def test_srgb_has_the_known_values():
    # IEC 61966-2-1: middle gray 0.5 is 0.2140 in linear light, code 188 about one half.
    assert SRGB().to_irradiance(0.5) == pytest.approx(0.21404114, abs=1e-7)
    assert SRGB().to_intensity(0.5) * 255 == pytest.approx(187.516, abs=1e-3)
    assert SRGB().to_intensity(0.002) == pytest.approx(12.92 * 0.002, abs=1e-12)


def test_one_coefficient_of_the_generalized_gamma_is_a_gamma():
    image = np.linspace(0, 1, 77)
    generalized = GeneralizedGamma((1 / 2.2,)).to_intensity(image)
    np.testing.assert_allclose(generalized, Gamma(2.2).to_intensity(image), atol=1e-12)


def test_square_root_is_a_polynomial_inverse():
    image = np.linspace(0, 1, 77)
    np.testing.assert_allclose(Polynomial((0, 1)).to_intensity(image), image**0.5, atol=1e-12)


def test_tabulated_keeps_its_own_read_only_samples():
    samples = np.array([0, 0.2, 1.0])
    curve = Tabulated(samples, samples)
    samples[1] = 0.9
    assert curve.irradiance[1] == 0.2
    for array in (curve.irradiance, curve.intensity, emor_table()):
        with pytest.raises(ValueError, match="read-only"):
            array[1] = 0.5


@pytest.mark.parametrize(
    "make",
    [
        lambda: Gamma(0),
        lambda: Gamma(-1),
        lambda: Gamma(np.inf),
        lambda: Gamma(np.nan),
        lambda: Polynomial(()),
        lambda: Polynomial((0.5, 0.6)),
        lambda: Polynomial((np.nan, 1)),
        lambda: Polynomial((4.0, -3.0)),
        lambda: GeneralizedGamma(()),
        lambda: GeneralizedGamma((-0.5,)),
        lambda: GeneralizedGamma((2.6, -10.0, 10.0)),
        lambda: Emor((40.0,)),
        lambda: Emor((np.nan,)),
        lambda: Emor((0.0,) * 26),
        lambda: Tabulated(np.array([0.0]), np.array([0.0])),
        lambda: Tabulated(np.array([0, 0.5, 1]), np.array([0, 1])),
        lambda: Tabulated(np.array([0, 0.5, 0.5, 1]), np.array([0, 0.2, 0.6, 1])),
        lambda: Tabulated(np.array([0, 1.0]), np.array([0.1, 1])),
        lambda: Tabulated(np.array([0, np.nan, 1]), np.array([0, 0.5, 1])),
        lambda: monotone([0, 0.5, 1], [1, 0.5, 0]),
        lambda: monotone([0, 0.5, 1], [0, np.nan, 1]),
        lambda: monotone([0, 0.5], [0, 1]),
        lambda: monotone([0, 0.5, 1], [0, 1]),
        lambda: monotone([], []),
    ],
)
def test_wrong_arguments_are_refused_with_what_was_expected(make):
    with pytest.raises(ValueError, match="expected"):
        make()
