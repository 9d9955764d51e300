"""The verb of the whole path, and its result."""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import arguments
from .._typing import FloatArray, Image
from ..deconvolution import Trust
from ..edges import Edge
from ..estimate import ResponseEstimate
from ..profiles import ProfileGroup
from ..progress import Job, drain
from ..psf import PsfEstimate, PsfField
from ..response import clipped_share
from .intermediates import Intermediates, made
from .options import DeblurOptions
from .path import Stage, walking


@dataclass(frozen=True, slots=True, eq=False)
class Deblurred:
    """Every intermediate of the whole path.

    Parameters
    ----------
    edges : tuple of Edge
        All edges, those that were rejected with their reason; empty if none were needed.
    groups : tuple of ProfileGroup
        Profiles across the good edges.
    responses : tuple of ResponseEstimate
        One for all channels, or one for each.
    linear : ndarray, shape (M, N) or (M, N, 3)
        Relative irradiance of the photo.
    psf : PsfEstimate
        Point spread function.
    sharp_linear : ndarray, the shape of `linear`
        Deconvolved irradiance; it can leave [0, 1].
    photo : ndarray
        The result: the response re-applied; shape and kind of the input, alpha kept.
    trust : Trust
        How much of each place was restored, and how far to believe it.
    field : PsfField, optional
        The PSFs of all parts, if each had its own.
    chosen : mapping of str to object
        What was chosen automatically, by the name of the option.
    """

    edges: tuple[Edge, ...]
    groups: tuple[ProfileGroup, ...]
    responses: tuple[ResponseEstimate, ...]
    linear: FloatArray
    psf: PsfEstimate
    sharp_linear: FloatArray
    photo: Image
    trust: Trust
    field: PsfField | None = None
    chosen: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    @classmethod
    def of(cls, have: Intermediates) -> "Deblurred":
        """What there is at the end of the path."""
        return cls(
            edges=made(have.edges, "edges"),
            groups=made(have.groups, "profiles"),
            responses=made(have.response, "a response").estimates,
            linear=made(have.linear, "linear light"),
            psf=made(have.psf, "a PSF"),
            sharp_linear=made(have.sharp_linear, "sharp light"),
            photo=made(have.result, "a result"),
            trust=made(have.trust, "a judgement"),
            field=have.field,
            chosen=have.chosen,
        )

    @property
    def clipped(self) -> float:
        """Share of the deconvolved values outside [0, 1], lost when the response is applied."""
        return clipped_share(self.sharp_linear)


def deblurring(
    photo: Image,
    options: DeblurOptions | None = None,
    *,
    observe: Callable[[Stage, Intermediates], object] | None = None,
) -> Job[Deblurred]:
    """Job of :func:`deblur`: reports progress, can be stopped.

    Parameters
    ----------
    photo, options
        As for :func:`deblur`.
    observe : callable, optional
        Called after each stage with it and with the intermediates by then.
    """
    start = Intermediates(np.asarray(arguments.array(photo, "a photo as an array")))
    chosen = DeblurOptions() if options is None else options
    return Deblurred.of((yield from walking(start, chosen, observe=observe)))


def deblur(photo: Image, options: DeblurOptions | None = None) -> Deblurred:
    """Deblur a photo in linear light, and keep every intermediate.

    Parameters
    ----------
    photo : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        uint8, uint16, or float in [0, 1].
    options : DeblurOptions, optional
        What is known, and the methods for the rest.

    Raises
    ------
    ValueError
        Not a photo, or options of another kind.
    CrfDeblurError
        The photo does not permit a step; the message says what to do.
    """
    return drain(deblurring(photo, options))
