"""What holds for single responses, and what they refuse."""

import numpy as np
import pytest

from napari_crfdeblur.response import (
    SRGB,
    Emor,
    Gamma,
    GeneralizedGamma,
    Identity,
    Polynomial,
    Tabulated,
    Tuned,
    dorf_mean,
    emor_table,
    monotone,
    tuned,
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


@pytest.mark.parametrize("offsets", [(), (0.0, 0.0)])
def test_an_untuned_curve_is_its_base(offsets):
    levels, base = np.linspace(0, 1, 5003), Gamma(2.2)
    curve = Tuned(base, offsets)
    np.testing.assert_array_equal(curve.to_intensity(levels), base.to_intensity(levels))
    np.testing.assert_array_equal(curve.to_irradiance(levels), base.to_irradiance(levels))
    np.testing.assert_array_equal(curve.slope(levels), base.slope(levels))


def test_tuning_adds_the_emor_curves_and_then_a_gamma():
    irradiance, table = np.linspace(0, 1, 1024), emor_table()
    moved = SRGB().to_intensity(irradiance) + 0.7 * table[1] - 0.3 * table[2]
    curve = Tuned(SRGB(), (0.7, -0.3), 1.25)
    np.testing.assert_allclose(curve.to_intensity(irradiance**1.25), moved, atol=1e-12)
    np.testing.assert_allclose(curve.to_irradiance(moved), irradiance**1.25, atol=1e-12)


def test_tuned_offsets_are_emor_coefficients_on_the_dorf_mean():
    levels = np.linspace(0, 1, 777)
    expected = Emor((0.7, -0.3)).to_irradiance(levels)
    np.testing.assert_allclose(
        Tuned(dorf_mean(), (0.7, -0.3)).to_irradiance(levels), expected, atol=1e-12
    )


def test_a_small_offset_changes_little_even_next_to_black():
    # A gamma rises from 0 to a tenth of the intensity within 6 of the 1024 samples.
    levels = np.linspace(0, 1, 5003)
    change = Tuned(Gamma(2.2), (1e-6,)).to_irradiance(levels) - Gamma(2.2).to_irradiance(levels)
    assert np.abs(change).max() < 1e-6


def test_the_slope_of_a_tuned_curve_is_a_number_even_at_black():
    for exponent, gamma in ((0.6, 2.0), (2.2, 0.3), (0.5, 2.0)):
        assert Tuned(Gamma(exponent), gamma=gamma).slope(0.0) >= 0


@pytest.mark.parametrize(
    "base", [Identity(), SRGB(), Gamma(2.2), Gamma(0.3), dorf_mean()], ids=repr
)
def test_sliders_always_give_a_curve(base):
    random = np.random.default_rng(3)
    for scale in (1e-300, 0.1, 3.0, 1e9):
        for _ in range(20):
            offsets = scale * random.normal(size=random.integers(1, 26))
            curve = tuned(base, offsets, 0.7)
            factors = np.array(curve.offsets) / offsets
            np.testing.assert_allclose(factors, factors[0], rtol=1e-6)
            assert 0 <= factors[0] <= 1


def test_offsets_are_shrunk_no_more_than_needed():
    assert tuned(SRGB(), (0.5, -0.2)) == Tuned(SRGB(), (0.5, -0.2))
    shrunk = np.array(tuned(SRGB(), (9.0, 4.0)).offsets)
    with pytest.raises(ValueError, match="strictly increasing"):
        Tuned(SRGB(), tuple(1.011 * shrunk))


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
        lambda: Tuned("srgb"),
        lambda: Tuned(SRGB(), (40.0,)),
        lambda: Tuned(SRGB(), (0.0,) * 26),
        lambda: Tuned(SRGB(), (np.nan,)),
        lambda: Tuned(SRGB(), (np.inf,)),
        lambda: Tuned(SRGB(), (), 0.0),
        lambda: tuned(SRGB(), (np.nan,)),
        lambda: tuned(SRGB(), (), -1.0),
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
