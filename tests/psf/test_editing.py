import numpy as np
import pytest

from napari_crfdeblur.psf import cleared, line


def test_clearing_takes_away_what_is_faint() -> None:
    psf = np.array([[0.0, 0.02, 0.1], [0.3, 0.5, 0.05], [0.0, 0.03, 0.0]])
    expected = np.array([[0, 0, 0.1], [0.3, 0.5, 0.05], [0, 0, 0]]) / 0.95
    np.testing.assert_allclose(cleared(psf, 0.1), expected)


def test_the_peak_always_stays() -> None:
    assert np.count_nonzero(cleared(np.array([[1.0, 3.0, 2.0]]), 1)) == 1


def test_clearing_nothing_changes_nothing() -> None:
    psf = line(7, 0.4)
    np.testing.assert_array_equal(cleared(psf, 0), psf)


@pytest.mark.parametrize("share", [-0.1, 1.1, np.nan])
def test_a_share_is_between_none_and_all(share: float) -> None:
    with pytest.raises(ValueError, match="share of the peak"):
        cleared(line(7, 0.4), share)
