"""The stage from what a photo shows to its point spread function: verb, method, result."""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from .._typing import BoolArray, FloatArray
from ..errors import CrfDeblurError
from ..profiles.base import ProfileGroup
from ..progress import Job, Progress, drain
from ..response import Response

if TYPE_CHECKING:
    from .field import PsfField

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
    diagnostics: dict[str, float] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        psf = np.array(self.psf, dtype=np.float64)
        psf.setflags(write=False)
        object.__setattr__(self, "psf", psf)


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What a photo shows of its PSF: the linear picture, and the profiles across its edges.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, C), optional
        Relative irradiance in [0, 1]; of more than 3 channels the first 3 count.
    clipped : ndarray of bool, the shape of `linear`, optional
        True where the camera saturated: those pixels are not used.
    groups : tuple of ProfileGroup
        Recorded profiles of one blur, of all channels and both polarities. Narrow groups serve
        best, such as those of ``ByOrientation(tolerance=radians(1))``.
    response : ResponseCurve or sequence of C of them, optional
        Of the profiles: one for all channels or one for each.
    """

    linear: FloatArray | None = None
    clipped: BoolArray | None = None
    groups: tuple[ProfileGroup, ...] = ()
    response: Response | None = None

    def __post_init__(self) -> None:
        if self.linear is not None:
            linear, clipped = _light(np.asarray(self.linear)), self.clipped
            if clipped is not None and np.shape(clipped) != np.shape(self.linear):
                raise ValueError(
                    f"expected clipped pixels of shape {linear.shape}, got {np.shape(clipped)}"
                )
            object.__setattr__(self, "linear", linear)
            if clipped is not None and np.ndim(clipped) > 2:
                object.__setattr__(self, "clipped", clipped[..., : linear.shape[-1]])
        groups = tuple(self.groups) if isinstance(self.groups, Sequence) else (None,)
        if not all(isinstance(group, ProfileGroup) for group in groups):
            raise ValueError(f"expected groups of profiles, got {self.groups!r:.80}")
        object.__setattr__(self, "groups", groups)

    @property
    def picture(self) -> FloatArray:
        """The linear picture, for a method that needs one.

        Raises
        ------
        ValueError
            There is none.
        """
        if self.linear is None:
            raise ValueError("expected a linear picture as evidence of the PSF, got none")
        return self.linear


def _light(linear: FloatArray) -> FloatArray:
    """A picture as methods take it: float32, at most 3 channels."""
    if linear.ndim not in (2, 3) or linear.size == 0 or linear.dtype.kind not in "fiub":
        raise ValueError(
            f"expected an image (M, N) or (M, N, 3), got {linear.dtype} of shape {linear.shape}"
        )
    return np.asarray(linear if linear.ndim == 2 else linear[..., :3], dtype=np.float32)


class PsfEstimator(ABC):
    """A method to find the PSF of a photo."""

    __slots__ = ()

    needs_picture: ClassVar[bool] = True
    """Whether it looks at the picture, so that it finds the PSF of any part of it, too."""
    needs_edges: ClassVar[bool] = False
    """Whether it looks at the profiles across straight edges."""

    @property
    def field(self) -> "PsfField | None":
        """The PSFs of all parts of the photo, if they are known."""
        return None

    @abstractmethod
    def run(self, evidence: Evidence) -> Job[PsfEstimate]:
        """Long job: estimate the PSF; what it looks at is there and finite, and not modified."""


def estimating_psf(evidence: Evidence | FloatArray, method: PsfEstimator) -> Job[PsfEstimate]:
    """Job of :func:`estimate_psf`: reports progress, can be stopped."""
    if not isinstance(method, PsfEstimator):
        raise ValueError(f"expected a method to find a PSF, got {method!r:.80}")
    seen = evidence if isinstance(evidence, Evidence) else Evidence(np.asarray(evidence))
    if seen.linear is not None:
        yield Progress("PSF", 0, 1)
        if not np.isfinite(seen.linear).all():
            raise CrfDeblurError(
                "the image has pixels that are not finite (NaN or infinity); replace them first"
            )
    return (yield from method.run(seen))


def estimate_psf(evidence: Evidence | FloatArray, method: PsfEstimator) -> PsfEstimate:
    """Estimate the point spread function of a photo.

    Parameters
    ----------
    evidence : ndarray, shape (M, N) or (M, N, 3), or Evidence
        Relative irradiance in [0, 1]; or all that is seen, such as clipped pixels, or the
        profiles of edges, from which :class:`~napari_crfdeblur.psf.RadonFit` finds it.
    method : PsfEstimator
        For example :class:`~napari_crfdeblur.psf.XuJia`.

    Raises
    ------
    ValueError
        What the method looks at is missing.
    CrfDeblurError
        The image shows too little structure, or the PSF does not fit in it.
    """
    return drain(estimating_psf(evidence, method))


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
