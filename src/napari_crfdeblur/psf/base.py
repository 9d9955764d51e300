"""The stage from a linear image to its point spread function: verb, method, result."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from .._typing import BoolArray, FloatArray
from ..errors import CrfDeblurError
from ..progress import Job, Progress, drain

SCALED = 1e-14  # distance of the sum from 1 that rounding leaves


class PsfStatus(Enum):
    """How far a PSF can be trusted; the value is the sentence that the user reads."""

    GOOD = "the PSF is clearly determined"
    GIVEN = "the PSF was given"
    EDITED = "the PSF was estimated, and edited by hand"
    BORROWED = "the PSF of this part follows from those of the others"
    DOUBTFUL = "the PSF is uncertain: choose a sharper-edged region or give the PSF size"
    INCOMPLETE = (
        "the edges leave the PSF open: add edges of other orientations, or find it from the picture"
    )

    @property
    def doubted(self) -> bool:
        """Whether the user should look at the PSF before it is used."""
        return self in (PsfStatus.DOUBTFUL, PsfStatus.INCOMPLETE)


@dataclass(frozen=True, slots=True, eq=False)
class PsfEstimate:
    """A point spread function and how it was found.

    Parameters
    ----------
    psf : ndarray, shape (H, W)
        Non-negative, sum 1, both sides odd, in (row, column) pixels; the blurred image is
        the convolution of the sharp one with it, and its center pixel is the origin. One that
        was given can have three dimensions, (D, H, W).
    status : PsfStatus
        How far it can be trusted.
    diagnostics : dict of str to float
        Figures of the method, by name.
    """

    psf: FloatArray
    status: PsfStatus
    diagnostics: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        psf = np.array(self.psf, dtype=np.float64)
        psf.setflags(write=False)
        object.__setattr__(self, "psf", psf)


class PsfEstimator(ABC):
    """A method to find the PSF of a linear image."""

    __slots__ = ()

    @abstractmethod
    def run(self, linear: FloatArray, *, clipped: BoolArray | None = None) -> Job[PsfEstimate]:
        """Long job: estimate the PSF of a linear image.

        Parameters
        ----------
        linear : ndarray, shape (M, N) or (M, N, 3)
            float32, relative irradiance in [0, 1], finite; not modified.
        clipped : ndarray of bool, the shape of `linear`, optional
            True where the camera saturated: those pixels are not used.
        """


def estimating_psf(
    linear: FloatArray, method: PsfEstimator, *, clipped: BoolArray | None = None
) -> Job[PsfEstimate]:
    """Job of :func:`estimate_psf`: reports progress, can be stopped."""
    linear = np.asarray(linear)
    if linear.ndim not in (2, 3) or linear.size == 0:
        raise ValueError(f"expected an image (M, N) or (M, N, 3), got {linear.shape}")
    if clipped is not None and clipped.shape != linear.shape:
        raise ValueError(f"expected clipped pixels of shape {linear.shape}, got {clipped.shape}")
    yield Progress("PSF", 0, 1)
    if not np.isfinite(linear).all():
        raise CrfDeblurError(
            "the image has pixels that are not finite (NaN or infinity); replace them first"
        )
    yield Progress("PSF", 0, 1)
    light = np.asarray(linear if linear.ndim == 2 else linear[..., :3], dtype=np.float32)
    if clipped is not None and clipped.ndim == 3:
        clipped = clipped[..., :3]
    return (yield from method.run(light, clipped=clipped))


def estimate_psf(
    linear: FloatArray, method: PsfEstimator, *, clipped: BoolArray | None = None
) -> PsfEstimate:
    """Estimate the point spread function of a linear image.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, 3)
        Relative irradiance in [0, 1].
    method : PsfEstimator
        For example :class:`~napari_crfdeblur.psf.XuJia`.
    clipped : ndarray of bool, the shape of `linear`, optional
        True where the camera saturated: those pixels are not used.

    Raises
    ------
    CrfDeblurError
        The image shows too little structure, or the PSF does not fit in it.
    """
    return drain(estimating_psf(linear, method, clipped=clipped))


def as_psf(values: ArrayLike) -> FloatArray:
    """Make a PSF of an array: check it, pad it to odd sides and scale it to sum 1.

    Parameters
    ----------
    values : array_like, shape (H, W), or (D, H, W) for volumes
        Non-negative, finite, not all zero. An even side gets zeros at its end, so that the
        origin stays at index ``side // 2``.

    Returns
    -------
    ndarray, shape (H | 1, W | 1) or (D | 1, H | 1, W | 1)
        float64, sum 1.

    Raises
    ------
    CrfDeblurError
        Color, negative, not finite or all zero.
    """
    psf = np.asarray(values, dtype=np.float64)
    if psf.ndim not in (2, 3) or _is_color(psf.shape):
        raise CrfDeblurError(
            f"the PSF has shape {psf.shape}; give a grayscale picture with rows and columns, "
            "or a stack of them"
        )
    if psf.size == 0 or not np.isfinite(psf).all():
        raise CrfDeblurError("the PSF is empty or has values that are not finite; mend it first")
    if psf.min() < 0:
        raise CrfDeblurError("the PSF has negative values; clip them to zero first")
    if psf.sum() <= 0:
        raise CrfDeblurError("the PSF is zero everywhere; give one that shows the blur")
    padded = np.pad(psf, [(0, 1 - side % 2) for side in psf.shape])
    # What was scaled before stays as it is, so that a PSF that is stored comes back the same.
    total = padded.sum()
    return padded if abs(total - 1) < SCALED else np.asarray(padded / total)


def as_planar_psf(values: ArrayLike) -> FloatArray:
    """Like :func:`as_psf`, for what has no depth: edges, profiles, and photos.

    Raises
    ------
    CrfDeblurError
        Not of shape (H, W), or no PSF at all.
    """
    if np.ndim(values) != 2:
        raise CrfDeblurError(
            f"the PSF has shape {np.shape(values)}; give a grayscale picture with rows and columns"
        )
    return as_psf(values)


def _is_color(shape: tuple[int, ...]) -> bool:
    """Whether this is a picture with channels; a volume is padded to more columns first."""
    return len(shape) == 3 and shape[2] in (3, 4) and min(shape[:2]) > shape[2]


def centered(psf: FloatArray) -> FloatArray:
    """Pad a PSF with zeros so that its center of mass falls on its center pixel.

    A PSF that is off center shifts the deblurred picture; nothing of it is cut off.

    Parameters
    ----------
    psf : ndarray, shape (H, W) or (D, H, W)
        Non-negative, sum 1, all sides odd.
    """
    pads = []
    for axis, side in enumerate(psf.shape):
        mass = psf.sum(axis=tuple(other for other in range(psf.ndim) if other != axis))
        off = round(float(mass @ np.arange(side))) - side // 2
        pads.append((max(-2 * off, 0), max(2 * off, 0)))
    return np.pad(psf, pads)


def cleared(psf: FloatArray, share: float) -> FloatArray:
    """Take away what is faint: zero below `share` of the peak, the rest scaled to sum 1.

    Parameters
    ----------
    psf : ndarray, shape (H, W)
        Non-negative, not all zero.
    share : float
        In [0, 1]; the peak itself stays.
    """
    if not 0 <= share <= 1:
        raise ValueError(f"expected a share of the peak within 0 and 1, got {share}")
    return as_psf(np.where(psf < share * psf.max(), 0.0, psf))
