import numpy as np
import pytest
from scipy.optimize import nnls

from napari_crfdeblur.psf.radon.nonnegative import nonnegative_minimum


@pytest.mark.parametrize("seed", range(5))
def test_it_is_the_nonnegative_least_squares_solution(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, target = rng.normal(size=(40, 25)), rng.normal(size=40)
    found = nonnegative_minimum(rows.T @ rows, rows.T @ target, np.ones(25))
    expected, _ = nnls(rows, target)
    assert found.min() >= 0
    # the search ends when a step changes less than a ten-thousandth
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_nothing_is_the_minimum_where_all_slopes_rise() -> None:
    found = nonnegative_minimum(np.eye(3), -np.ones(3), np.zeros(3))
    np.testing.assert_array_equal(found, np.zeros(3))
