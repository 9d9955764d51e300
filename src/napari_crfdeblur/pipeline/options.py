"""How a photo is deblurred: everything that can be chosen, checked where it is made."""

from dataclasses import dataclass, field
from types import NoneType
from typing import TypeAlias

from .. import arguments
from ..deconvolution import Deconvolver
from ..edges import Edge, Line, Rectangle
from ..errors import CrfDeblurError
from ..estimate import MaximumLikelihood, ResponseFit
from ..psf import PsfEstimator
from ..psf.parts import PartGrid, part_counts
from .blur import check_fit

Drawn: TypeAlias = Edge | Line | Rectangle
"""What tells where an edge is: one that was measured, or a drawn line or rectangle."""


@dataclass(frozen=True, slots=True)
class DeblurOptions:
    """How a photo is deblurred; the defaults do everything from the photo itself.

    Parameters
    ----------
    response : ResponseFit
        How the response is found; :class:`~.estimate.PerChannel` for one of each channel,
        :class:`~.estimate.GivenResponse` if it is known.
    edges : sequence of Edge, Line or Rectangle, optional
        Edges drawn by the user: lines and rectangles are refined on the photo, edges that were
        measured already are taken as they are. Found automatically if not given.
    blur_extent : float, optional
        Largest width of a blurred edge in pixels; judged from the photo if not given.
    psf : PsfEstimator, optional
        How the PSF is found; by default :class:`~.psf.Portfolio`, or
        :class:`~.psf.GivenPsf` if it is known. :class:`~.psf.RadonFit` finds it from the
        straight edges alone.
    method : Deconvolver, optional
        How the blur is undone; by default :class:`~.deconvolution.LocalShrinkage`.
    settle_light : bool
        Whether, where the photo does not tell its response, its values are taken as light if the
        restoration rings less so (:class:`~.trial.LightTrial`).
    guard : bool
        Whether the result gives way to the photo where it is impossible
        (:func:`~.deconvolution.guard`).
    regions : int or (int, int), optional
        Rows and columns of parts of the photo, or parts along its longer side, each of which
        gets a PSF of its own; by default one PSF serves the whole photo.

    Raises
    ------
    ValueError
        A method of another kind, an extent that is not above 0, no part at all.
    """

    response: ResponseFit = field(default_factory=MaximumLikelihood)
    edges: tuple[Drawn, ...] | None = None
    blur_extent: float | None = None
    psf: PsfEstimator | None = None
    method: Deconvolver | None = None
    regions: int | PartGrid | None = None
    settle_light: bool = True
    guard: bool = True

    def __post_init__(self) -> None:
        arguments.instance(self.response, ResponseFit, "a method to find the response")
        arguments.instance(self.psf, (PsfEstimator, NoneType), "a method to find the PSF")
        arguments.instance(self.method, (Deconvolver, NoneType), "a method of deconvolution")
        arguments.instance(self.settle_light, bool, "whether the light is settled by trial")
        arguments.instance(self.guard, bool, "whether the result is guarded")
        if self.edges is not None:
            edges = arguments.instances(
                self.edges, (Edge, Line, Rectangle), "edges, lines and rectangles"
            )
            object.__setattr__(self, "edges", tuple(edges))
        if self.blur_extent is not None:
            extent = arguments.number(self.blur_extent, "a blur extent in pixels", above=0)
            object.__setattr__(self, "blur_extent", float(extent))
        if self.regions is not None:
            object.__setattr__(self, "regions", part_counts(self.regions))

    def check_for(self, sides: PartGrid, channels: int) -> None:
        """Refuse what does not fit a photo, before any work.

        Parameters
        ----------
        sides : (int, int)
            Rows and columns of the photo.
        channels : int
            1 or 3.

        Raises
        ------
        CrfDeblurError
            A blur wider than the photo, more parts than it has rows or columns, the PSFs of
            the parts of another picture, or responses for other channels.
        """
        if self.blur_extent is not None and self.blur_extent > max(sides):
            raise CrfDeblurError(
                f"a blur of {self.blur_extent:g} pixels is wider than the photo of "
                f"{sides[1]} x {sides[0]}; give a smaller blur extent"
            )
        parts = self.regions if isinstance(self.regions, tuple) else (self.regions or 1, 1)
        most = sides if isinstance(self.regions, tuple) else (max(sides), 1)
        if any(count > side for count, side in zip(parts, most, strict=True)):
            raise CrfDeblurError(
                f"{self.regions} parts are more than the photo of {sides[1]} x {sides[0]} pixels "
                "has; ask for fewer"
            )
        if self.psf is not None and self.psf.field is not None:
            check_fit(self.psf.field, sides, "the photo")
        if self.response.channels not in (None, channels):
            raise CrfDeblurError(
                f"{self.response.channels} responses do not fit the {channels} channels of the "
                "photo; use one response for all"
            )
