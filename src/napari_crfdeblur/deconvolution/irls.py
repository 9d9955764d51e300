"""Deconvolution with a sparse prior by reweighted least squares: thorough, and slow."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..boundary import extending, frame
from ..fourier import forward, gradient_power, inverse, laplacian_power
from ..progress import Job, Progress
from .highlights import filling
from .noise import PlaneStatistics
from .recorded import RecordedBlur, blurring
from .regularized import Regularized

SECOND = 0.25  # share of the second derivatives in the prior
SMALLEST = 0.01  # difference at which |d|^alpha is rounded off, for contrast 1
SMOOTHING = 0.03  # of the first guess, from which any similar value leads to the same place
HALO = 2  # rows that the highest derivative reaches


@dataclass(frozen=True, slots=True)
class SparseIrls(Regularized):
    """Minimize ``1/2 |k * x - y|^2 + w sum_j c_j |D_j x|^alpha`` by reweighting.

    The sparse prior of Levin, Fergus, Durand & Freeman (2007, Image and depth from a
    conventional camera with a coded aperture) on first derivatives (``c = 1``) and second
    ones (``c = .25``). Every reweighting replaces ``|d|^alpha`` by
    ``alpha/2 max(|d|, .01)^(alpha - 2) d^2`` and solves the linear system that follows by
    conjugate gradients, preconditioned by the same system with the mean weights, which is
    diagonal in the Fourier domain. Only what was recorded takes part in the first term: what
    the scene sheds beyond the border is free, and so is what it adds to saturated pixels. The
    plane is scaled to contrast 1 meanwhile, so that
    affine changes of the plane change the result alike.

    Parameters
    ----------
    weight : float, optional
        `w`, for a plane of contrast 1 (four standard deviations). By default it follows from
        the noise level and the errors of the plane.
    model_error : float, optional
        Least noise that is reckoned with, as a share of the contrast; by default measured.
    exponent : float
        `alpha`, between 0 and 2; 0.8 in the paper.
    iterations : int
        Number of reweightings.
    steps : int
        Steps of conjugate gradients in each.
    """

    FACTOR = 2.5  # best on average over pictures, PSFs and noise of .003 to .03

    exponent: float = 0.8
    iterations: int = 4
    steps: int = 4

    def __post_init__(self) -> None:
        Regularized.__post_init__(self)
        arguments.number(self.exponent, "an exponent", above=0, below=2)
        arguments.step_count(self.iterations, "a number of iterations")
        most = arguments.MOST_STEPS // self.iterations
        arguments.step_count(self.steps, "a number of steps", most=most)

    def run(
        self,
        plane: FloatArray,
        psf: FloatArray,
        *,
        clipped: BoolArray | None = None,
        weights: FloatArray | None = None,
        statistics: PlaneStatistics | None = None,
    ) -> Job[FloatArray]:
        """Long job: deconvolve a plane or volume with a checked PSF."""
        each = 1 + self.steps
        total = 2 + self.iterations * each
        reports = [Progress("sparse IRLS", done, total) for done in range(total + 1)]
        yield reports[0]
        found, weight = self.judge(plane, psf, clipped, statistics)
        filled = yield from filling(plane, psf, clipped, reports[0])
        extended = yield from extending(filled.plane, psf, reports[0])
        extended /= found.contrast
        yield reports[1]
        scaled = plane / found.contrast
        blur = yield from blurring(extended, scaled, psf, clipped, reports[1], weights)
        sharp = yield from _guessing(extended, blur, reports[1])
        for box, scene in filled.scenes:
            sharp[box] = scene / found.contrast
        target = yield from blur.reversing(extended, reports[1])
        del extended
        for done in range(2, total, each):
            changed = yield from blur.choosing(sharp, reports[done])
            target = target if changed is None else changed
            priors = yield from _weighing(sharp, weight, self.exponent, reports[done])
            system = _System(blur, priors)
            yield from _solving(system, target, sharp, reports[done + 1 : done + each + 1])
            del system, priors  # five planes, before the next five are made
        return sharp[frame(plane.shape)] * found.contrast


def _guessing(extended: FloatArray, blur: RecordedBlur, at: Progress) -> Job[FloatArray]:
    """Job: a linear first guess of `x`, from the light that was guessed in the gaps, too."""
    spectrum = forward(extended)
    yield at
    blur.correlate(spectrum)
    powers = gradient_power(extended.shape, extended)
    for block in arrays.blocks(spectrum):
        diagonal = SMOOTHING * laplacian_power(powers, block)
        diagonal += blur.gain[block, ...]
        spectrum[block, ...] /= diagonal
    guess = inverse(spectrum, extended.shape)
    yield at
    return guess


def _derivatives(axes: int) -> Iterator[tuple[int, ...]]:
    """Orders along each axis: all first derivatives, then all second ones."""
    for order in (1, 2):
        yield from (tuple(order * (axis == own) for axis in range(axes)) for own in range(axes))
    for pair in combinations(range(axes), 2):
        yield tuple(int(axis in pair) for axis in range(axes))


class _System:
    """``A = K'MK + sum_j D_j' W_j D_j``, and an approximate inverse.

    That has the mean weights, and all pixels recorded.
    """

    def __init__(self, blur: RecordedBlur, weights: list[FloatArray]) -> None:
        self.blur, self.weights, self.shape = blur, weights, weights[0].shape
        means = [arrays.mean(each) for each in weights]
        axes = len(self.shape)
        first, second = sum(means[:axes]) / axes, sum(means[axes:]) / len(means[axes:])
        self.diagonal = laplacian_power(gradient_power(self.shape, weights[0]))
        for block in arrays.blocks(self.diagonal):
            laplacian = self.diagonal[block, ...]
            self.diagonal[block, ...] = (second * laplacian + first) * laplacian
        self.diagonal += blur.gain

    def applying(self, plane: FloatArray, at: Progress) -> Job[FloatArray]:
        """Job: ``A x``."""
        result = yield from self.blur.back_and_forth(plane, at)
        yield at
        for block in arrays.blocks(result):
            result[block, ...] += self._prior(plane, block)
        return result

    def _prior(self, plane: FloatArray, block: slice) -> FloatArray:
        """Rows of ``sum_j D_j' W_j D_j x``."""
        # two more rows on either side: what wraps around within the part stays in these
        rows = np.arange(block.start - HALO, block.stop + HALO) % self.shape[0]
        part = arrays.take_rows(plane, rows)
        total: FloatArray = 0 * part
        for orders, weight in zip(_derivatives(part.ndim), self.weights, strict=True):
            total += _adjoint(arrays.take_rows(weight, rows) * _derivative(part, orders), orders)
        inner: FloatArray = total[HALO:-HALO, ...]
        return inner

    def preconditioning(self, plane: FloatArray, at: Progress) -> Job[FloatArray]:
        """Job: the approximate inverse, applied."""
        spectrum = forward(plane)
        yield at
        spectrum /= self.diagonal
        return inverse(spectrum, self.shape)


def _solving(
    system: _System, target: FloatArray, plane: FloatArray, reports: Sequence[Progress]
) -> Job[None]:
    """Job: solve ``A x = target`` from and in `plane`, a step between every two reports."""
    yield reports[0]
    residual = target - (yield from system.applying(plane, reports[0]))
    yield reports[0]
    negligible = (1e-7 * arrays.norm(target)) ** 2  # what single precision leaves
    direction, energy = 0 * plane, 1.0
    for before, after in pairwise(reports):
        correction = yield from system.preconditioning(residual, before)
        previous, energy = energy, arrays.dot(residual, correction)
        if energy > negligible:
            direction *= energy / previous
            direction += correction
            yield before
            image = yield from system.applying(direction, before)
            length = energy / arrays.dot(direction, image)
            plane += length * direction
            image *= length
            residual -= image
        yield after


def _weighing(
    plane: FloatArray, weight: float, exponent: float, at: Progress
) -> Job[list[FloatArray]]:
    """Job: second derivative of the prior at every difference: ``w c alpha |d|^(alpha - 2)``."""
    weights = []
    for orders in _derivatives(plane.ndim):
        size = abs(_derivative(plane, orders))
        arrays.raise_to(size, SMALLEST)
        size **= exponent - 2
        size *= weight * exponent * (1 if sum(orders) == 1 else SECOND)
        weights.append(size)
        yield at
    return weights


def _derivative(plane: FloatArray, orders: tuple[int, ...]) -> FloatArray:
    """Forward differences of a periodic plane, as often as `orders` says along each axis."""
    return _differences(plane, orders, -1)


def _adjoint(plane: FloatArray, orders: tuple[int, ...]) -> FloatArray:
    return _differences(plane, orders, 1)


def _differences(plane: FloatArray, orders: tuple[int, ...], shift: int) -> FloatArray:
    xp = arrays.namespace(plane)
    for axis, order in enumerate(orders):
        for _ in range(order):
            plane = xp.roll(plane, shift, axis=axis) - plane
    return plane
