"""One motion of the camera behind the PSFs of all parts of a picture."""

from dataclasses import dataclass
from math import ceil

import numpy as np
from scipy import sparse

from ... import arguments
from ..._typing import FloatArray
from ...errors import CrfDeblurError

STEP = 1.0  # pixel that the farthest part moves from one turn to the next
ITERATIONS = 60  # of expectation maximization
FAINT = 1e-12  # keeps quotients finite


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """How long the camera was in each pose: shifted by whole pixels, and turned.

    Parameters
    ----------
    turns : ndarray, shape (A,)
        About the middle of the picture, radians from the column axis towards the row axis.
    times : ndarray, shape (A, S, S)
        Share of the exposure in each pose, by turn, row and column of the shift; S odd, the
        shift 0 at the center; non-negative, of sum 1.
    """

    turns: FloatArray
    times: FloatArray

    def __post_init__(self) -> None:
        for name, axes in (("turns", 1), ("times", 3)):
            values = arguments.kept(getattr(self, name), name, axes=(axes,))
            object.__setattr__(self, name, values)
        count, rows, columns = self.times.shape
        if count != len(self.turns) or rows != columns or rows % 2 == 0:
            raise ValueError(
                f"expected times of shape ({len(self.turns)}, S, S), S odd, got {self.times.shape}"
            )
        if self.times.min() < 0 or not FAINT < self.times.sum() < np.inf:
            raise ValueError("expected times of at least 0, some of them above, of a finite sum")
        if np.abs(self.turns).max() > 2 * np.pi:
            raise ValueError("expected turns of up to 2 pi radians, got larger ones")

    @property
    def spread(self) -> float:
        """Standard deviation of the turns over the exposure, radians."""
        share = self.times.sum(axis=(1, 2))
        mean = float(share @ self.turns)
        return float(np.sqrt(share @ (self.turns - mean) ** 2))

    def psf_at(self, offset: tuple[float, float]) -> FloatArray:
        """The PSF `offset` pixels (rows, columns) from the middle of the picture, (S, S)."""
        size = self.times.shape[1]
        psf = rendering(self.turns, offset, size) @ self.times.ravel()
        if not psf.sum() > FAINT:
            raise CrfDeblurError(
                "the turns of the camera carry all light out of the PSF; give smaller turns or "
                "larger PSFs"
            )
        return np.asarray(psf.reshape(size, size) / psf.sum())


def rendering(turns: FloatArray, offset: tuple[float, float], size: int) -> sparse.csr_array:
    """Matrix from the times of all poses to the PSF at an offset from the middle.

    Shape ``(S^2, A S^2)``. A small turn moves light at ``x`` by ``turn (x_column, -x_row)``;
    what falls between four pixels is shared by them, and what leaves the array is lost.
    """
    indices = np.indices((size, size)).reshape(2, -1)
    own = np.arange(size * size)
    values, rows, columns = [], [], []
    for number, turn in enumerate(turns):
        shift = turn * offset[1], -turn * offset[0]
        whole = np.floor(shift).astype(int)
        part = shift - whole
        for corner in np.ndindex(2, 2):
            share = float(np.prod(np.abs(1 - np.array(corner) - part)))
            target = indices + (whole + corner)[:, None]
            kept = ((target >= 0) & (target < size)).all(axis=0) & (share > 0)
            values.append(np.full(int(kept.sum()), share))
            rows.append((target[0] * size + target[1])[kept])
            columns.append(own[kept] + number * size * size)
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return sparse.csr_array(entries, (size * size, len(turns) * size * size))


def fit_poses(
    psfs: FloatArray, offsets: FloatArray, weights: FloatArray, turns: FloatArray
) -> Poses:
    """The motion of a camera that best explains the PSFs of the parts of a picture.

    Expectation maximization for ``k_i = sum_p w_p T_pi``, the mixture of Whyte et al. (2012,
    Non-uniform deblurring for shaken images, Eq. 8), from PSFs in place of the picture: keeps
    the times `w` non-negative, and never makes the likelihood smaller.

    Parameters
    ----------
    psfs : ndarray, shape (P, S, S)
        PSFs of the parts, centroid at the center.
    offsets : ndarray, shape (P, 2)
        Of the parts from the middle of the picture, pixels.
    weights : ndarray, shape (P,)
        How much each counts, at least 0.
    turns : ndarray, shape (A,)
        Turns that are possible, radians.
    """
    size = psfs.shape[1]
    mean = np.tensordot(weights / weights.sum(), psfs, axes=1) + 1 / (size * size) ** 2
    counted = np.flatnonzero(weights > 0)
    matrix = sparse.vstack([rendering(turns, tuple(offsets[i]), size) for i in counted])
    matrix = sparse.csr_array(matrix)
    observed = psfs[counted].reshape(-1)
    weight = np.repeat(weights[counted], size * size)
    times = np.tile(mean.ravel() / mean.sum() / len(turns), len(turns))
    total = matrix.T @ weight + FAINT
    for _ in range(ITERATIONS):
        times *= (matrix.T @ (weight * observed / (matrix @ times + FAINT))) / total
    return Poses(turns, (times / times.sum()).reshape(len(turns), size, size))


def turns_within(reach: float, farthest: float) -> FloatArray:
    """Turns that move light at most `reach` pixels at `farthest` pixels from the middle."""
    count = 2 * ceil(reach / STEP) + 1
    return np.linspace(-reach, reach, count) / farthest if reach else np.zeros(1)
