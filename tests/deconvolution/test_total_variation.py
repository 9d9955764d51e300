"""Total variation: its minimum, against a solver that knows nothing of ADMM."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage, optimize

from napari_crfdeblur import arrays, fourier
from napari_crfdeblur.boundary import periodic_shape
from napari_crfdeblur.deconvolution import deconvolve, measure
from napari_crfdeblur.deconvolution import total_variation as tv
from napari_crfdeblur.deconvolution.total_variation import TotalVariation


def hook() -> NDArray[np.float64]:
    psf = np.zeros((5, 4))
    psf[1:4, 1], psf[3, 1:] = 1, 2
    return psf / psf.sum()


def gradient(scene):
    return [np.roll(scene, -1, axis) - scene for axis in range(scene.ndim)]


class Objective:
    """``1/2 |M (k * x - y)|^2 + w sum |D x|`` on the periodic plane, and a smooth bound of it."""

    def __init__(self, blurred, psf, weight):
        self.blurred, self.weight = blurred, weight
        self.shape = periodic_shape(blurred.shape, psf.shape)
        self.transfer = fourier.otf(psf, self.shape, float)

    def __call__(self, scene, rounding=0.0):
        misfit = self.misfit(scene)
        size = np.sqrt(sum(each**2 for each in gradient(scene)) + rounding**2)
        return (misfit**2).sum() / 2 + self.weight * size.sum()

    def misfit(self, scene):
        seen = fourier.convolve(scene, self.transfer)
        misfit = np.zeros(self.shape)
        rows, columns = self.blurred.shape
        misfit[:rows, :columns] = seen[:rows, :columns] - self.blurred
        return misfit

    def slope(self, scene, rounding):
        parts = gradient(scene)
        size = np.sqrt(sum(each**2 for each in parts) + rounding**2)
        total = fourier.correlate(self.misfit(scene), self.transfer)
        for axis, each in enumerate(parts):
            ratio = self.weight * each / size
            total += np.roll(ratio, 1, axis) - ratio
        return total


def test_the_known_minimum_is_reached():
    rng = np.random.default_rng(3)
    sharp = (ndimage.gaussian_filter(rng.normal(size=(22, 27)), 3) > 0).astype(float)
    blurred = ndimage.convolve(sharp, hook(), mode="wrap") + rng.normal(0, 0.02, sharp.shape)
    scale, weight = measure(blurred).contrast, 5e-3
    objective, best = Objective(blurred / scale, hook(), weight), None
    best = np.full(objective.shape, blurred.mean() / scale)
    for rounding in (1e-1, 1e-2, 1e-3, 1e-4):
        best = optimize.minimize(
            lambda x, r=rounding: objective(x.reshape(objective.shape), r),
            best.ravel(),
            jac=lambda x, r=rounding: objective.slope(x.reshape(objective.shape), r).ravel(),
            method="L-BFGS-B",
            options={"maxiter": 1000, "maxfun": 3000},
        ).x.reshape(objective.shape)
    found = deconvolve(blurred, hook(), TotalVariation(weight, iterations=400)) / scale
    # 1e-4 of rounding and both solvers' last steps; in the middle the border has no say
    inner = np.s_[4:-4, 4:-4]
    expected = best[: blurred.shape[0], : blurred.shape[1]]
    assert np.sqrt(np.mean((found - expected)[inner] ** 2)) < 5e-3


def test_few_iterations_come_near_to_many():
    rng = np.random.default_rng(4)
    sharp = (ndimage.gaussian_filter(rng.normal(size=(60, 70)), 3) > 0).astype(float)
    blurred = ndimage.convolve(sharp, hook(), mode="wrap") + rng.normal(0, 0.02, sharp.shape)
    many = deconvolve(blurred, hook(), TotalVariation(iterations=300))
    errors = [
        np.sqrt(np.mean((deconvolve(blurred, hook(), TotalVariation(iterations=n)) - many) ** 2))
        for n in (5, 20, 80)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[1] < 0.01  # measured .004, for contrast 1.9


def test_without_blur_it_is_the_denoising_of_rudin_osher_and_fatemi():
    step = np.zeros((30, 40))
    step[:, 20:] = 1
    scale, weight = measure(step).contrast, 0.02
    delta = np.ones((1, 1))
    # periodic: two edges of each row, that of one side lowered by 2 w / width, the other raised
    found = deconvolve(step, delta, TotalVariation(weight, iterations=300))
    width = 20
    assert found[15, 30] == pytest.approx(1 - 2 * weight * scale / width, abs=1e-4)
    assert found[15, 10] == pytest.approx(2 * weight * scale / width, abs=1e-4)


def test_blocks_are_the_whole(monkeypatch):
    rng = np.random.default_rng(5)
    plane, multipliers = rng.normal(size=(23, 17)), list(rng.normal(size=(2, 23, 17)))
    gradients = [d + u for d, u in zip(gradient(plane), multipliers, strict=True)]
    kept = 0.7 / np.maximum(np.hypot(*gradients), 0.7)
    pulls = [g * (1 - 2 * kept) for g in gradients]
    expected = sum(np.roll(p, 1, axis) - p for axis, p in enumerate(pulls))
    monkeypatch.setattr(arrays, "BLOCK", 5 * 17)
    tv.split(plane, multipliers, 0.7)
    np.testing.assert_allclose(plane, expected, atol=1e-12)
    for multiplier, each in zip(multipliers, gradients, strict=True):
        np.testing.assert_allclose(multiplier, kept * each, atol=1e-12)


@pytest.mark.parametrize("options", [{"iterations": 0}, {"weight": -1.0}, {"model_error": -0.1}])
def test_bad_parameters_are_refused(options):
    with pytest.raises(ValueError, match="expected"):
        TotalVariation(**options)
