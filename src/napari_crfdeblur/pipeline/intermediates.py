"""What the path has made of a photo so far: one frozen value, filled stage by stage."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType, NoneType
from typing import Any, TypeVar

import numpy as np

from .. import arguments
from .._typing import BoolArray, FloatArray, Image
from ..deconvolution import Trust
from ..edges import Edge
from ..estimate import Responses
from ..photo import ALPHA
from ..profiles import ProfileGroup
from ..psf import PsfEstimate, PsfField
from ..response import clipped_light, pixel_worth
from .trial import LightTrial

GROUND = 0.35  # share of the pixels of a channel: more are not lamps, but what lies behind
PLANE, VOLUME = 2, 3  # axes
T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class Intermediates:
    """A photo, and what the stages of the path have made of it; what is missing is None.

    Parameters
    ----------
    photo : ndarray, shape (M, N), (M, N, 3) or (M, N, 4); with slices before for a volume
        As recorded: uint8, uint16 or float in [0, 1].
    axes : int
        Of the photo that are blurred: 2, or 3 for a volume; one more holds the colors.
    index : int
        Number of the photo among several of one camera.
    extent : float, optional
        Largest width of a blurred edge in pixels.
    edges : tuple of Edge, optional
        All edges, those that were rejected with their reason; empty if none were needed.
    groups : tuple of ProfileGroup, optional
        Profiles across the good edges.
    response : Responses, optional
        One for all channels, or one for each.
    linear : ndarray, the shape of `photo` without alpha, optional
        Relative irradiance.
    psf : PsfEstimate, optional
        Point spread function of the whole.
    trial : LightTrial, optional
        Which light was tried, where the response is a guess.
    field : PsfField, optional
        The PSFs of all parts, if each has its own.
    sharp_linear : ndarray, optional
        Deconvolved irradiance; it can leave [0, 1].
    trust : Trust, optional
        How far `sharp_linear` can be believed.
    result : ndarray, optional
        The response re-applied, in the kind of `photo`, alpha kept.
    chosen : mapping of str to object
        What the stages chose by themselves, by the name of the option.
    """

    photo: Image
    axes: int = PLANE
    index: int = 0
    extent: float | None = None
    edges: tuple[Edge, ...] | None = None
    groups: tuple[ProfileGroup, ...] | None = None
    response: Responses | None = None
    linear: FloatArray | None = None
    psf: PsfEstimate | None = None
    trial: LightTrial | None = None
    field: PsfField | None = None
    sharp_linear: FloatArray | None = None
    trust: Trust | None = None
    result: Image | None = None
    chosen: Mapping[str, Any] = dataclasses.field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        arguments.whole(self.axes, "a number of axes", least=PLANE, most=VOLUME)
        axes = self.axes, self.axes + 1
        for name in ("photo", "linear", "sharp_linear", "result"):
            value = getattr(self, name)
            if value is not None or name == "photo":
                what = f"{name} as an array with {self.axes} axes, or one more for colors"
                arguments.array(arguments.instance(value, np.ndarray, what), what, axes=axes)
        arguments.whole(self.index, "the number of a photo", least=0)
        if self.extent is not None:
            arguments.number(self.extent, "a blur extent in pixels", above=0)
        if self.edges is not None:
            arguments.instances(self.edges, Edge, "edges")
        if self.groups is not None:
            arguments.instances(self.groups, ProfileGroup, "groups of profiles")
        kinds = (
            ("response", Responses),
            ("psf", PsfEstimate),
            ("trial", LightTrial),
            ("field", PsfField),
            ("trust", Trust),
        )
        for name, kind in kinds:
            arguments.instance(getattr(self, name), (kind, NoneType), f"{kind.__name__} or None")
        arguments.instance(self.chosen, Mapping, "what was chosen, by the name of the option")

    @property
    def has_colors(self) -> bool:
        """Whether the last axis holds channels."""
        return self.photo.ndim > self.axes

    @property
    def colors(self) -> Image:
        """The photo without its alpha channel, as a view."""
        return self.photo[..., :3] if self.has_colors else self.photo

    @property
    def channels(self) -> int:
        """Of light: 1 or 3."""
        return self.colors.shape[-1] if self.has_colors else 1

    @property
    def sides(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.photo.shape[self.axes - PLANE : self.axes]
        return int(rows), int(columns)

    @property
    def clipped(self) -> BoolArray:
        """Where the camera saturated, the shape of `linear`."""
        return clipped_light(self.colors, axes=self.axes)

    @property
    def lamps(self) -> BoolArray:
        """Where light was brighter than recorded: what is clipped, unless that is the ground.

        What is white in so much of a photo is paper or a screen, as bright as white. Taken for a
        lower bound, it would hold any light: text on white, whose white just saturates, loses 3 to
        6 dB so; where it is 15 % brighter, no way is better, and at 40 % lamps win by .1 to .5 dB.
        """
        clipped = self.clipped
        for channel in np.ndindex(clipped.shape[self.axes :]):
            own = (..., *channel)
            if clipped[own].mean() > GROUND:
                clipped[own] = False
        return clipped

    @property
    def worth(self) -> FloatArray | None:
        """What each pixel of `linear` is worth, by the slope of the response; None if all alike."""
        linear = made(self.linear, "linear light")
        curves = made(self.response, "a response").estimates
        if not self.has_colors:
            return pixel_worth(linear, curves[0].curve)
        found = [
            pixel_worth(linear[..., number], curves[number % len(curves)].curve)
            for number in range(self.channels)
        ]
        if all(each is None for each in found):
            return None
        alike = np.ones(linear.shape[:-1], dtype=np.float32)
        return np.stack([alike if each is None else each for each in found], axis=-1)

    @property
    def alpha(self) -> Image | None:
        """The alpha channel with its axis, if the photo has one."""
        return self.photo[..., 3:] if self.has_colors and self.photo.shape[-1] == ALPHA else None

    def choosing(self, **chosen: Any) -> "Intermediates":
        """With what a stage has chosen by itself."""
        return replace(self, chosen=MappingProxyType({**self.chosen, **chosen}))


def in_rows(pixels: Image, axes: int) -> Image:
    """A picture (M, N) or (M, N, C) of what may be a volume: its slices below each other."""
    return pixels.reshape(-1, *pixels.shape[axes - 1 :])


def made(product: T | None, name: str) -> T:
    """What an earlier stage has made.

    Raises
    ------
    ValueError
        It was skipped.
    """
    if product is None:
        raise ValueError(f"expected {name}, which an earlier stage of the path makes, got none")
    return product
