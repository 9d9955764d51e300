import numpy as np
import pytest

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.psf import GivenPsf, PsfStatus, estimate_psf


def test_the_given_psf_is_scaled_and_padded() -> None:
    estimate = estimate_psf(np.zeros((9, 12)), GivenPsf(np.array([[1.0, 2.0], [0.0, 1.0]])))
    np.testing.assert_array_equal(estimate.psf, np.array([[1, 2, 0], [0, 1, 0], [0, 0, 0]]) / 4)
    assert estimate.status is PsfStatus.GIVEN


def test_a_psf_larger_than_the_image_is_refused() -> None:
    with pytest.raises(CrfDeblurError, match="3 x 7 pixels, is larger than the image"):
        estimate_psf(np.zeros((6, 12)), GivenPsf(np.ones((7, 3))))


def test_the_given_psf_is_a_copy_that_cannot_change() -> None:
    values = np.ones((3, 3))
    method = GivenPsf(values)
    values[:] = 7
    assert method.psf.max() == pytest.approx(1 / 9)
    with pytest.raises(ValueError, match="read-only"):
        method.psf[0, 0] = 1


@pytest.mark.parametrize("wrong", [np.ones((2, 2, 2, 2)), -np.ones((3, 3)), np.zeros((3, 3))])
def test_what_is_no_psf_is_refused(wrong) -> None:
    with pytest.raises(CrfDeblurError):
        GivenPsf(wrong)


def test_a_psf_that_was_scaled_stays_the_same_to_the_last_bit() -> None:
    random = np.random.default_rng(2)
    for side in (3, 9, 31):
        once = GivenPsf(random.random((side, side + 4)))
        np.testing.assert_array_equal(GivenPsf(once.psf).psf, once.psf)
