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

    def unexplained(self) -> float:
        """``sqrt(n + e)`` of the most likely `n`, `e` and `a`."""
        floor = float(np.median(self.powers)) or float(self.powers.mean())
        own = self._in_cells(self.powers) / self._in_cells(self.passed)
        start = np.log(np.maximum([floor, floor, *own], NOTHING * floor))
        found = optimize.minimize(self.unlikelihood, start, jac=True, method="L-BFGS-B")
        return float(np.sqrt(np.exp(found.x[:ERRORS]).sum()))

    def unlikelihood(self, logarithms: FloatArray) -> tuple[float, FloatArray]:
        """Minus the mean logarithm of the likelihood of ``log (n, e, a)``, and its gradient."""
        white, colored, *_ = values = np.exp(logarithms)
        own = values[ERRORS:][self.cell]
        expected = own * self.passed + white + colored * self.falling
        ratio = self.powers / expected
        pull = (1 - ratio) / (expected * len(expected))
        errors = pull.sum(), np.vdot(self.falling, pull)
        slopes = np.concatenate([errors, self._in_cells(self.passed * pull)])
        return float((ratio + np.log(expected)).mean()), values * slopes

    def _in_cells(self, values: FloatArray) -> FloatArray:
        """Sums over the cells."""
        return np.asarray(np.bincount(self.cell, values))


def _starts(cell: NDArray[np.intp]) -> NDArray[np.intp]:
    """Where groups of at most so many frequencies begin, each in one cell; cells are sorted."""
    first = np.searchsorted(cell, cell)
    return np.flatnonzero((np.arange(len(cell)) - first) % TOGETHER == 0)
