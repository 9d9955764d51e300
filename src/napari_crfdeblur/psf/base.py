"""The stage from what a photo shows to its point spread function: verb, method, result."""

import dataclasses
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments
from .._typing import BoolArray, FloatArray
from ..errors import CrfDeblurError
from ..profiles.base import ProfileGroup
from ..progress import Job, Progress, drain
from ..response import Response, ResponseCurve
from .field import PsfField
from .status import PsfStatus

SCALED = 1e-14  # distance of the sum from 1 that rounding leaves


NARROW = 3.0  # pixels over which the light of a point is spread: a Gaussian of half a pixel


@dataclass(frozen=True, slots=True, eq=False)
class PsfEstimate:
    """A point spread function and how it was found.

    Parameters
    ----------
    psf : ndarray, shape (H, W)
        Non-negative, in (row, column) pixels; scaled to sum 1 and padded to odd sides by
        :func:`as_psf`. The blurred image is the convolution of the sharp one with it, and its
        center pixel is the origin. One that was given can have three dimensions, (D, H, W).
    status : PsfStatus
        How far it can be trusted.
    diagnostics : dict of str to float
        Figures of the method, by name.
    """

    psf: FloatArray
    status: PsfStatus
    diagnostics: dict[str, float] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        arguments.instance(self.status, PsfStatus, "a status of a PSF")
        arguments.instance(self.diagnostics, dict, "figures by their names")
        psf = as_psf(self.psf)
        psf.setflags(write=False)
        object.__setattr__(self, "psf", psf)

    @property
    def sentence(self) -> str:
        """How far it can be trusted, and whether there is hardly any blur, for the user."""
        if 1 / float(np.square(self.psf).sum()) < NARROW:
            return f"{self.status.value}; the photo is hardly blurred"
        return str(self.status.value)


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
    certain: bool
        Whether the picture is known to be linear; not where its response is a guess.
    """

    linear: FloatArray | None = None
    clipped: BoolArray | None = None
    groups: tuple[ProfileGroup, ...] = ()
    response: Response | None = None
    certain: bool = True

    def __post_init__(self) -> None:
        if self.linear is not None:
            whole = arguments.array(self.linear, "an image (M, N) or (M, N, 3)", axes=(2, 3))
            linear = _light(whole)
            object.__setattr__(self, "linear", linear)
            if self.clipped is not None:
                object.__setattr__(self, "clipped", _clipped(self.clipped, whole.shape))
        elif self.clipped is not None:
            raise arguments.refusal("clipped pixels together with their image", self.clipped)
        groups = arguments.instances(self.groups, ProfileGroup, "groups of profiles")
        object.__setattr__(self, "groups", tuple(groups))
        if not (self.response is None or isinstance(self.response, ResponseCurve)):
            what = "a response curve, or one for each channel"
            arguments.instances(self.response, ResponseCurve, what)
        arguments.instance(self.certain, bool, "whether the picture is known to be linear")

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
    if 0 in linear.shape:
        raise arguments.refusal("an image (M, N) or (M, N, 3)", linear)
    seen = linear if linear.ndim == 2 else linear[..., :3]
    arguments.check_pixels(seen)
    return np.asarray(seen, dtype=np.float32)


def _clipped(clipped: BoolArray, shape: tuple[int, ...]) -> BoolArray:
    """Clipped pixels of a picture of this shape, of the channels that count."""
    found = arguments.array(clipped, "clipped pixels as bool", kinds=("bool",))
    if found.shape != shape:
        raise ValueError(f"expected clipped pixels of shape {shape}, got {found.shape}")
    return np.asarray(found if found.ndim == 2 else found[..., :3])


class PsfEstimator(ABC):
    """A method to find the PSF of a photo."""

    __slots__ = ()

    needs_picture: ClassVar[bool] = True
    """Whether it looks at the picture, so that it finds the PSF of any part of it, too."""
    needs_edges: ClassVar[bool] = False
    """Whether it looks at the profiles across straight edges."""

    @property
    def field(self) -> PsfField | None:
        """The PSFs of all parts of the photo, if they are known."""
        return None

    @abstractmethod
    def run(self, evidence: Evidence) -> Job[PsfEstimate]:
        """Long job: estimate the PSF; what it looks at is there and finite, and not modified."""


def estimating_psf(evidence: Evidence | FloatArray, method: PsfEstimator) -> Job[PsfEstimate]:
    """Job of :func:`estimate_psf`: reports progress, can be stopped."""
    arguments.instance(method, PsfEstimator, "a method to find a PSF")
    if evidence is None:
        raise arguments.refusal("an image or other evidence of a PSF", evidence)
    seen = evidence if isinstance(evidence, Evidence) else Evidence(evidence)
    if seen.linear is not None:
        yield Progress("PSF", 0, 1)
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
    ValueError
        No real numbers, or so large that they cannot be added.
    CrfDeblurError
        Color, negative, not finite or all zero.
    """
    psf = arguments.addable(values, "a PSF")
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
    psf = arguments.array(values, "a PSF")
    if psf.ndim != 2:
        raise CrfDeblurError(
            f"the PSF has shape {tuple(psf.shape)}; give a grayscale picture with rows and columns"
        )
    return as_psf(psf)


def _is_color(shape: tuple[int, ...]) -> bool:
    """Whether this is a picture with channels; a volume is padded to more columns first."""
    return len(shape) == 3 and shape[2] in (3, 4) and min(shape[:2]) > shape[2]


def centered(psf: FloatArray) -> FloatArray:
    """Pad a PSF with zeros so that its center of mass falls on its center pixel.

    A PSF that is off center shifts the deblurred picture; nothing of it is cut off.

    Parameters
    ----------
    psf : ndarray, shape (H, W) or (D, H, W)
        What :func:`as_psf` takes, and is made of it first.

    Raises
    ------
    CrfDeblurError
        As of :func:`as_psf`.
    """
    psf = as_psf(psf)
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
    psf : ndarray, shape (H, W) or (D, H, W)
        What :func:`as_psf` takes.
    share : float
        In [0, 1]; the peak itself stays.

    Raises
    ------
    CrfDeblurError
        As of :func:`as_psf`.
    """
    arguments.number(share, "a share of the peak", least=0, most=1)
    psf = as_psf(psf)
    return as_psf(np.where(psf < share * psf.max(), 0.0, psf))
