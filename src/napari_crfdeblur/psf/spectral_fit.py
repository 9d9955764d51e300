"""The spectrum of a blurred picture as that of a sharp one, let through, and of errors."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, optimize

from .._typing import FloatArray

# Cycles per pixel. Below, frequencies are few, and the pictures' own spectra vary too much.
LOWEST, HIGHEST = 0.1, 0.5
MIDDLE = 0.25  # the frequency at which the misfit is given
FALL = 3  # power of the frequency by which errors fall that are not white
RINGS, SECTORS = 8, 8  # in which the sharp picture has the same power
TOGETHER = 16  # frequencies that are fitted as one
ERRORS = 2  # parts of what is unexplained: white, and falling
NOTHING = 1e-12  # share of the power that is none: rounding
# Slope at which the fit ends, and longest step, both in logarithms. Newton steps go on until
# rounding no longer shows in the result: pictures must not depend on how a processor adds.
CONVERGED, WIDEST_STEP = 1e-10, 30.0
ROUGHLY = 1e-5  # slope at which the likelihood is known to a millionth, where PSFs are compared


@dataclass(frozen=True, slots=True, eq=False)
class SpectralFit:
    """Powers at the frequencies that tell, and what they are made of.

    Frequencies of one cell that the PSF lets through alike are taken together: what is fitted to
    their mean is as likely as what is fitted to each.

    Parameters
    ----------
    powers, passed, falling : ndarray, shape (F,)
        Of the blurred picture; the share that the PSF lets through; ``(1/4 / |f|)^3``.
    cell : ndarray of int, shape (F,)
        In which the sharp picture has the same power.
    """

    powers: FloatArray
    passed: FloatArray
    falling: FloatArray
    cell: NDArray[np.intp]

    @classmethod
    def of(cls, powers: FloatArray, passed: FloatArray) -> "SpectralFit":
        """Those of half a spectrum between the lowest and the highest frequency."""
        rows, columns = powers.shape[0], 2 * (powers.shape[1] - 1)
        across, along = fft.fftfreq(rows)[:, None], fft.rfftfreq(columns)[None]
        frequency = np.hypot(across, along)
        seen = (frequency >= LOWEST) & (frequency < HIGHEST)
        ring = RINGS * np.log(frequency[seen] / LOWEST) / np.log(HIGHEST / LOWEST)
        sector = SECTORS * (np.arctan2(across, along)[seen] / np.pi + 0.5)
        cell = ring.astype(int) * SECTORS + np.minimum(sector.astype(int), SECTORS - 1)
        passed = np.maximum(passed[seen], NOTHING)
        order = np.lexsort((passed, cell))
        falling = (MIDDLE / frequency[seen]) ** FALL
        starts = _starts(cell[order])
        counts = np.diff([*starts, len(order)])
        parts = np.stack([powers[seen], passed, falling])[:, order]
        powers, passed, falling = np.add.reduceat(parts, starts, axis=1) / counts
        own = np.unique(cell[order][starts], return_inverse=True)[1]
        return cls(powers, passed, falling, own)

    def blocked(self, most: float) -> float:
        """Share of the frequencies of which at most so much passes."""
        return float((self.passed <= most).mean())

    def unexplained(self) -> float:
        """``sqrt(n + e)`` of the most likely `n`, `e` and `a`."""
        return float(np.sqrt(np.exp(self._likeliest(CONVERGED).x[:ERRORS]).sum()))

    def likelihood(self) -> float:
        """Mean logarithm of the likelihood of the most likely `n`, `e` and `a`."""
        return -float(self._likeliest(ROUGHLY).fun)

    def _likeliest(self, converged: float) -> optimize.OptimizeResult:
        floor = float(np.median(self.powers)) or float(self.powers.mean())
        own = self._in_cells(self.powers) / self._in_cells(self.passed)
        start = np.log(np.maximum([floor, floor, *own], NOTHING * floor))
        return optimize.minimize(
            self.unlikelihood,
            start,
            jac=True,
            hess=self.curvature,
            method="trust-exact",
            options={"gtol": converged, "max_trust_radius": WIDEST_STEP},
        )

    def unlikelihood(self, logarithms: FloatArray) -> tuple[float, FloatArray]:
        """Minus the mean logarithm of the likelihood of ``log (n, e, a)``, and its gradient."""
        values = np.exp(logarithms)
        expected = self._expected(values)
        ratio = self.powers / expected
        slopes = self._onto_values((1 - ratio) / expected)
        return float((ratio + np.log(expected)).mean()), values * slopes

    def curvature(self, logarithms: FloatArray) -> FloatArray:
        """Second derivatives of :meth:`unlikelihood`, an array of shape (2 + C, 2 + C)."""
        values = np.exp(logarithms)
        expected = self._expected(values)
        ratio = self.powers / expected
        bend = (2 * ratio - 1) / expected**2
        second = np.diag(self._onto_values(self.passed * bend))
        second[0, :] = second[:, 0] = self._onto_values(bend)
        second[1, :] = second[:, 1] = self._onto_values(self.falling * bend)
        slopes = self._onto_values((1 - ratio) / expected)
        return np.outer(values, values) * second + np.diag(values * slopes)

    def _expected(self, values: FloatArray) -> FloatArray:
        """The powers if `n`, `e` and `a` are these."""
        white, colored = values[:ERRORS]
        sharp = values[ERRORS:][self.cell] * self.passed
        return np.asarray(sharp + white + colored * self.falling)

    def _onto_values(self, pull: FloatArray) -> FloatArray:
        """What a pull at every frequency comes to for `n`, `e` and every `a`, in the mean."""
        errors = pull.sum(), (self.falling * pull).sum()
        return np.concatenate([errors, self._in_cells(self.passed * pull)]) / len(pull)

    def _in_cells(self, values: FloatArray) -> FloatArray:
        """Sums over the cells."""
        return np.asarray(np.bincount(self.cell, values))


def _starts(cell: NDArray[np.intp]) -> NDArray[np.intp]:
    """Where groups of at most so many frequencies begin, each in one cell; cells are sorted."""
    first = np.searchsorted(cell, cell)
    return np.flatnonzero((np.arange(len(cell)) - first) % TOGETHER == 0)
