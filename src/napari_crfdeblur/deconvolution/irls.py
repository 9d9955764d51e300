"""Deconvolution with a sparse prior by reweighted least squares: thorough, and slow."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .._typing import FloatArray
from ..boundary import extending
from ..fourier import Shape, forward, gradient_power, inverse, otf, power, row_blocks
from ..progress import Job, Progress
from .base import Deconvolver
from .noise import LEAST_NOISE, check_weight, contrast, relative_noise

WEIGHT_OF_NOISE = 2.5  # best on average over pictures, PSFs and noise of .003 to .03
SECOND = 0.25  # share of the second derivatives in the prior
SMALLEST = 0.01  # difference at which |d|^alpha is rounded off, for contrast 1
SMOOTHING = 0.03  # of the first guess, from which any similar value leads to the same place
HALO = 2  # rows that the highest derivative reaches
DERIVATIVES = ((1, 0), (0, 1), (2, 0), (0, 2), (1, 1))  # orders along rows and columns


@dataclass(frozen=True, slots=True)
class SparseIrls(Deconvolver):
    """Minimize ``1/2 |k * x - y|^2 + w sum_j c_j |D_j x|^alpha`` by reweighting.

    The sparse prior of Levin, Fergus, Durand & Freeman (2007, Image and depth from a
    conventional camera with a coded aperture) on first derivatives (``c = 1``) and second
    ones (``c = .25``). Every reweighting replaces ``|d|^alpha`` by
    ``alpha/2 max(|d|, .01)^(alpha - 2) d^2`` and solves the linear system that follows by
    conjugate gradients, preconditioned by the same system with the mean weights, which is
    diagonal in the Fourier domain. The plane is scaled to contrast 1 meanwhile, so that
    affine changes of the plane change the result alike.

    Parameters
    ----------
    weight : float, optional
        `w`, for a plane of contrast 1 (four standard deviations). By default it follows from
        the noise level of the plane.
    model_error : float
        Least noise that is reckoned with, as a share of the contrast: it stands for the errors
        of the PSF and the response, rounding and compression. With an estimated PSF give .01.
    exponent : float
        `alpha`, between 0 and 2; 0.8 in the paper.
    iterations : int
        Number of reweightings.
    steps : int
        Steps of conjugate gradients in each.
    """

    weight: float | None = None
    model_error: float = LEAST_NOISE
    exponent: float = 0.8
    iterations: int = 4
    steps: int = 4

    def __post_init__(self) -> None:
        check_weight(self.weight, self.model_error)
        if not 0 < self.exponent < 2:
            raise ValueError(f"expected an exponent between 0 and 2, got {self.exponent}")
        if self.iterations < 1 or self.steps < 1:
            raise ValueError(
                f"expected at least 1 iteration of 1 step, got {self.iterations} of {self.steps}"
            )

    def run(self, plane: FloatArray, psf: FloatArray) -> Job[FloatArray]:
        """Long job: deconvolve a plane of shape (M, N) with a checked PSF."""
        each = 1 + self.steps
        total = 2 + self.iterations * each
        reports = [Progress("sparse IRLS", done, total) for done in range(total + 1)]
        yield reports[0]
        weight = self.weight or WEIGHT_OF_NOISE * relative_noise(plane, self.model_error) ** 2
        scale = contrast(plane)
        blurred = yield from extending(plane, psf, reports[0])
        blurred /= plane.dtype.type(scale)
        gain, target, sharp = yield from _preparing(blurred, psf, reports[1])
        for done in range(2, total, each):
            weights = yield from _weighing(sharp, weight, self.exponent, reports[done])
            system = _System(gain, weights)
            yield from _solving(system, target, sharp, reports[done + 1 : done + each + 1])
            del system, weights  # five planes, before the next five are made
        return sharp[: plane.shape[0], : plane.shape[1]] * plane.dtype.type(scale)


def _preparing(
    plane: FloatArray, psf: FloatArray, at: Progress
) -> Job[tuple[FloatArray, FloatArray, FloatArray]]:
    """Job: power of the transfer function, ``k' * y``, and a linear first guess of `x`."""
    yield at
    transfer = otf(psf, plane.shape, plane.dtype)
    gain = power(transfer)
    yield at
    spectrum = forward(plane)
    spectrum *= np.conj(transfer, out=transfer)
    yield at
    target = inverse(spectrum.copy(), plane.shape)
    yield at
    spectrum /= gain + SMOOTHING * _laplacian(plane.shape, gain)
    return gain, target, inverse(spectrum, plane.shape)


def _laplacian(shape: Shape, like: FloatArray) -> FloatArray:
    rows, columns = gradient_power(shape, like.dtype)
    return rows[:, None] + columns


class _System:
    """``A = K'K + sum_j D_j' W_j D_j``, and its approximate inverse with the mean weights."""

    def __init__(self, gain: FloatArray, weights: list[FloatArray]) -> None:
        self.gain, self.weights, self.shape = gain, weights, weights[0].shape
        means = [float(each.mean()) for each in weights]
        laplacian = _laplacian(self.shape, gain)
        self.diagonal = np.mean(means[2:]) * laplacian
        self.diagonal += np.mean(means[:2])
        self.diagonal *= laplacian
        self.diagonal += gain
        self.diagonal = self.diagonal.astype(gain.dtype, copy=False)

    def applying(self, plane: FloatArray, at: Progress) -> Job[FloatArray]:
        """Job: ``A x``."""
        spectrum = forward(plane)
        yield at
        spectrum *= self.gain
        result = inverse(spectrum, self.shape)
        yield at
        for block in row_blocks(self.shape):
            result[block] += self._prior(plane, block)
        return result

    def _prior(self, plane: FloatArray, block: slice) -> FloatArray:
        """Rows of ``sum_j D_j' W_j D_j x``."""
        # two more rows on either side: what wraps around within the part stays in these
        rows = np.arange(block.start - HALO, block.stop + HALO) % len(plane)
        part = plane[rows]
        total: FloatArray = np.zeros_like(part)
        for orders, weight in zip(DERIVATIVES, self.weights, strict=True):
            total += _adjoint(weight[rows] * _derivative(part, orders), orders)
        return total[HALO:-HALO]

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
    negligible = (1e-7 * np.linalg.norm(target)) ** 2  # what single precision leaves
    direction, energy = np.zeros_like(plane), 1.0
    for before, after in pairwise(reports):
        correction = yield from system.preconditioning(residual, before)
        previous, energy = energy, float(np.vdot(residual, correction))
        if energy > negligible:
            direction *= energy / previous
            direction += correction
            yield before
            image = yield from system.applying(direction, before)
            length = energy / float(np.vdot(direction, image))
            plane += length * direction
            image *= length
            residual -= image
        yield after


def _weighing(
    plane: FloatArray, weight: float, exponent: float, at: Progress
) -> Job[list[FloatArray]]:
    """Job: second derivative of the prior at every difference: ``w c alpha |d|^(alpha - 2)``."""
    weights = []
    for orders in DERIVATIVES:
        size = np.abs(_derivative(plane, orders))
        np.maximum(size, SMALLEST, out=size)
        np.power(size, exponent - 2, out=size)
        size *= weight * exponent * (1 if sum(orders) == 1 else SECOND)
        weights.append(size)
        yield at
    return weights


def _derivative(plane: FloatArray, orders: tuple[int, int]) -> FloatArray:
    """Forward differences of a periodic plane, as often as `orders` says along each axis."""
    for axis, order in enumerate(orders):
        for _ in range(order):
            plane = np.roll(plane, -1, axis) - plane
    return plane


def _adjoint(plane: FloatArray, orders: tuple[int, int]) -> FloatArray:
    for axis, order in enumerate(orders):
        for _ in range(order):
            plane = np.roll(plane, 1, axis) - plane
    return plane
