"""The PSFs of all parts of a picture: found blindly one by one, then held together."""

from dataclasses import dataclass, replace
from math import ceil, inf

import numpy as np
from scipy import ndimage

from .. import arguments
from .._typing import BoolArray, FloatArray
from ..errors import CrfDeblurError
from ..fourier import Shape
from ..progress import Job, Progress, drain, nth
from .base import Evidence, PsfEstimate, PsfEstimator, as_planar_psf
from .blind.estimation import BlindEstimator
from .blind.size import extent_of, odd_size
from .field import PsfField
from .field.base import offset_from_middle, part_centers
from .field.poses import Poses, fit_poses, turns_within
from .status import PsfStatus

PartGrid = tuple[int, int]

OVERLAP = 1.4  # sides of a part: the window in which its PSF is looked for
ROOM = 1.6  # times the extent of the PSF of the whole: the array in which those of parts are
LEAST_SIDE = 2  # sizes of the PSF: the smallest part, and
NARROWEST = 5  # sizes of the PSF: the narrowest window that shows it
ROUNDS = 3  # of fitting the motion, moving the PSFs onto it, and weighing them by it
# Greatest way of light by turns alone, as shares of the PSF's array: none, and more and more.
REACHES = (0.0, 1 / 16, 1 / 8, 1 / 4)
# Less turn is preferred if its misfit is at most ``1 + ALLOWANCE / parts`` times the smallest:
# PSFs of parts differ by errors, too, of which a turn explains the more the fewer they are.
ALLOWANCE = 3.0
DOUBTED = 0.3  # weight of a PSF that is called uncertain
LEAST_COSINE, AGREEING = 0.3, 0.75  # to what the motion says: counts for nothing, and is found


@dataclass(frozen=True, slots=True, eq=False)
class _PartPsfs:
    """What the search in all parts gives: PSFs (P, S, S), their weights, offsets (P, 2)."""

    psfs: FloatArray
    weights: FloatArray
    offsets: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Explained:
    """A motion, the PSFs of all parts that it means, and their cosines to those found."""

    poses: Poses
    predicted: FloatArray
    cosines: FloatArray


def estimating_psf_field(
    linear: FloatArray,
    method: PsfEstimator,
    whole: PsfEstimate,
    *,
    grid: int | PartGrid,
    clipped: BoolArray | None = None,
) -> Job[PsfField]:
    """Job of :func:`estimate_psf_field`: reports progress, can be stopped."""
    evidence = Evidence(linear, clipped)
    linear, clipped = evidence.picture, evidence.clipped
    arguments.instance(whole, PsfEstimate, "the PsfEstimate of the whole picture")
    shape = linear.shape[0], linear.shape[1]
    grid = grid_of(grid, shape)
    size = _size(as_planar_psf(whole.psf), shape, grid)
    estimates: list[PsfEstimate | None] = []
    windows = _windows(shape, grid, size)
    for number, (rows, columns) in enumerate(windows):
        own = None if clipped is None else clipped[rows, columns]
        job = _tried(linear[rows, columns], own, _sized(method, size))
        estimates.append((yield from nth(job, number, len(windows), "PSF, part")))
    yield Progress("motion of the camera", 0, 1)
    return _held_together(estimates, whole, shape, grid)


def estimate_psf_field(
    linear: FloatArray,
    method: PsfEstimator,
    whole: PsfEstimate,
    *,
    grid: int | PartGrid,
    clipped: BoolArray | None = None,
) -> PsfField:
    """Find how the PSF of a picture varies from part to part.

    The method looks for the PSF of every part. Those found are explained by one motion of the
    camera (:class:`~.poses.Poses`), which tells the PSFs of parts that show none, and
    outvotes PSFs that do not fit the others.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, 3)
        Relative irradiance.
    method : PsfEstimator
        A blind estimator, such as :class:`~napari_crfdeblur.psf.XuJia`; its `size` is set by
        the PSF of the whole.
    whole : PsfEstimate
        The PSF of the whole picture, as :func:`~napari_crfdeblur.psf.estimate_psf` gives it.
    grid : int or (int, int)
        Rows and columns of parts, or parts along the longer side.
    clipped : ndarray of bool, the shape of `linear`, optional
        Pixels that the camera saturated.

    Raises
    ------
    ValueError
        An impossible grid, or a method without a size.
    CrfDeblurError
        Parts so small that no PSF can be found in them.
    """
    return drain(estimating_psf_field(linear, method, whole, grid=grid, clipped=clipped))


def grid_of(regions: int | PartGrid, shape: Shape) -> PartGrid:
    """Rows and columns of parts: as given, or about square parts, so many on the longer side."""
    parts = part_counts(regions, most=max(shape))
    if isinstance(parts, tuple):
        return parts
    side = max(shape) / parts
    return max(round(shape[0] / side), 1), max(round(shape[1] / side), 1)


def part_counts(regions: int | PartGrid, most: float = inf) -> int | PartGrid:
    """How many parts were asked for: along the longer side, or rows and columns of them.

    Raises
    ------
    ValueError
        Neither a whole number from 1 to `most`, nor two of them.
    """
    what = "a whole number of parts, or rows and columns of them,"
    if not isinstance(regions, tuple | list):
        return arguments.whole(regions, what, least=1, most=most)
    if len(regions) != 2:
        raise arguments.refusal(what, regions)
    rows, columns = (arguments.whole(count, what, least=1, most=most) for count in regions)
    return rows, columns


def _size(whole: FloatArray, shape: Shape, grid: PartGrid) -> int:
    """Size of the PSFs of parts: they can be longer than that of the whole."""
    narrowest = min(side / count for side, count in zip(shape, grid, strict=True))
    size = odd_size(ROOM * extent_of(whole), max(whole.shape) * 2)
    if narrowest < LEAST_SIDE * size:
        raise CrfDeblurError(
            f"parts of {narrowest:.0f} pixels are too small to find PSFs of {size} pixels in "
            "them; ask for fewer parts"
        )
    return size


def _windows(shape: Shape, grid: PartGrid, size: int) -> list[tuple[slice, slice]]:
    """Rows and columns of the overlapping windows, one for each part, row by row."""
    windows = []
    for center in part_centers(shape, grid).reshape(-1, 2):
        spans = []
        for place, side, count in zip(center, shape, grid, strict=True):
            length = min(ceil(max(OVERLAP * side / count, NARROWEST * size)), side)
            start = min(max(round(place - length / 2), 0), side - length)
            spans.append(slice(start, start + length))
        windows.append((spans[0], spans[1]))
    return windows


def _sized(method: PsfEstimator, size: int) -> PsfEstimator:
    """The same method for PSFs of a size."""
    if not isinstance(method, BlindEstimator):
        raise arguments.refusal("a blind estimator for the parts", method)
    return replace(method, size=size)


def _tried(
    linear: FloatArray, clipped: BoolArray | None, method: PsfEstimator
) -> Job[PsfEstimate | None]:
    """The PSF of a part; None if it shows too little."""
    try:
        return (yield from method.run(Evidence(linear, clipped)))
    except CrfDeblurError:
        return None


def _held_together(
    estimates: list[PsfEstimate | None], whole: PsfEstimate, shape: Shape, grid: PartGrid
) -> PsfField:
    """The PSFs of all parts that one motion gives; that of the whole if it has no turn."""
    found = _aligned(estimates, whole, shape, grid)
    size, farthest = found.psfs.shape[1], max(float(np.hypot(*found.offsets.T).max()), 1.0)
    fits = [_explained(found, turns_within(share * size, farthest)) for share in REACHES]
    misfits = [float(1 - np.average(fit.cosines, weights=found.weights)) for fit in fits]
    limit = (1 + ALLOWANCE / np.count_nonzero(found.weights)) * min(misfits)
    fit = next(f for f, misfit in zip(fits, misfits, strict=True) if misfit <= limit)
    statuses = [
        own.status if own is not None and cosine >= AGREEING else PsfStatus.BORROWED
        for own, cosine in zip(estimates, fit.cosines, strict=True)
    ]
    rows = tuple(tuple(statuses[r * grid[1] : (r + 1) * grid[1]]) for r in range(grid[0]))
    figures = {
        "agreement": float(np.average(fit.cosines, weights=found.weights)),
        "uniform": 1 - misfits[0],
        "turn": float(np.degrees(fit.poses.spread)),
    }
    poses = fit.poses
    if not poses.spread:
        poses = Poses(poses.turns, _padded(whole.psf, size)[None])
    centers = [(float(row), float(column)) for row, column in found.offsets]
    psfs = np.stack([poses.psf_at(center) for center in centers]).reshape(*grid, size, size)
    return PsfField(psfs, rows, shape, poses, figures)


def _explained(found: _PartPsfs, turns: FloatArray) -> _Explained:
    """The motion with some of these turns that explains the PSFs of most parts."""
    trust, weights = found.weights, found.weights
    psfs = found.psfs
    for _ in range(ROUNDS):
        poses = fit_poses(psfs, found.offsets, weights, turns)
        predicted = np.stack([poses.psf_at((float(r), float(c))) for r, c in found.offsets])
        psfs = np.stack([_moved_onto(*pair) for pair in zip(psfs, predicted, strict=True)])
        cosines = _cosines(psfs, predicted)
        weights = trust * np.clip((cosines - LEAST_COSINE) / (1 - LEAST_COSINE), 0.01, 1) ** 2
    return _Explained(poses, predicted, cosines)


def _aligned(
    estimates: list[PsfEstimate | None], whole: PsfEstimate, shape: Shape, grid: PartGrid
) -> _PartPsfs:
    """The PSFs in arrays of one size, their centroids at the center; none: the whole's."""
    filled = [whole.psf if own is None else own.psf for own in estimates]
    size = max(max(psf.shape) for psf in (*filled, whole.psf)) | 1
    weights = [0.0 if own is None else DOUBTED if own.status.doubted else 1.0 for own in estimates]
    if not any(weights):
        weights = [1.0] * len(weights)
    centers = part_centers(shape, grid).reshape(-1, 2)
    offsets = np.array([offset_from_middle((r, c), shape) for r, c in centers])
    return _PartPsfs(np.stack([_centroid_at(p, size) for p in filled]), np.array(weights), offsets)


def _centroid_at(psf: FloatArray, size: int) -> FloatArray:
    """A PSF in a square array of so many pixels, its centroid exactly at the center."""
    wide = _padded(psf, size)
    return _shifted(wide, size // 2 - np.array(ndimage.center_of_mass(wide)))


def _padded(psf: FloatArray, size: int) -> FloatArray:
    return np.pad(psf, [((size - side) // 2,) * 2 for side in psf.shape])


def _moved_onto(psf: FloatArray, other: FloatArray) -> FloatArray:
    """A PSF at the place where it is most like another one, to a part of a pixel."""
    size = len(psf)
    padded = (2 * size, 2 * size)
    spectrum = np.fft.rfft2(other, padded) * np.conj(np.fft.rfft2(psf, padded))
    match = np.fft.fftshift(np.fft.irfft2(spectrum, padded))
    peak = np.array(np.unravel_index(int(np.argmax(match)), match.shape))
    part = []
    for axis in (0, 1):
        line = np.take(match, peak[1 - axis], axis=1 - axis)
        before, at, after = line[[peak[axis] - 1, peak[axis], (peak[axis] + 1) % (2 * size)]]
        bend = before - 2 * at + after
        part.append(0.5 * (before - after) / bend if bend < 0 else 0.0)
    return _shifted(psf, peak - size + np.array(part))


def _shifted(psf: FloatArray, shift: FloatArray) -> FloatArray:
    moved = np.maximum(ndimage.shift(psf, shift, order=3), 0)
    return np.asarray(moved / moved.sum() if moved.sum() > 0 else psf)


def _cosines(first: FloatArray, second: FloatArray) -> FloatArray:
    product = (first * second).sum(axis=(1, 2))
    return np.asarray(
        product / np.linalg.norm(first, axis=(1, 2)) / np.linalg.norm(second, axis=(1, 2))
    )
