"""The path: edges, profiles, response, linear light, PSF, trial, field, restored, re-applied.

Each stage is a job that takes what earlier ones have made, and adds its own. This is the one
description of the path: library, command, batch, tiles and window drive it with
:func:`walking`. They start where they have something already, stop where they need no more, look
on, or put another function in the place of a stage.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from enum import Enum
from math import radians
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from .. import arguments
from .._typing import FloatArray, Image
from ..deconvolution import (
    Deconvolver,
    LocalShrinkage,
    deconvolving,
    judging,
    measure_channels,
)
from ..deconvolution.varying import deconvolving_varying
from ..edges import Edge, estimating_blur_extent, finding_edges, refining_edges
from ..errors import CrfDeblurError
from ..estimate import estimating_responses
from ..photo import check_intensities, check_photo, to_unit
from ..profiles import ByOrientation, ProfileGroup, sampling_profiles
from ..progress import Job
from ..psf import (
    Evidence,
    Portfolio,
    PsfEstimator,
    Variational,
    estimating_psf,
    estimating_psf_field,
)
from ..response import linearizing, reapplying
from .intermediates import PLANE, Intermediates, in_rows, made
from .options import DeblurOptions, Drawn
from .trial import LightTrial, taken_as_light, trying_light

DEFAULT_METHOD: Deconvolver = LocalShrinkage()  # the best on photos
# A PSF of 20 pixels looks alike along normals this near each other, to a sixth of a pixel.
NARROW = ByOrientation(tolerance=radians(1))


class Stage(Enum):
    """A stage of the path, in order; the value is the name of what it makes."""

    EDGES = "edges"
    PROFILES = "groups"
    RESPONSE = "response"
    LINEAR = "linear"
    PSF = "psf"
    TRIAL = "trial"
    FIELD = "field"
    RESTORE = "sharp_linear"
    REAPPLY = "result"

    def is_done(self, have: Intermediates) -> bool:
        """Whether what it makes is there."""
        return getattr(have, self.value) is not None


SEEKING = {Stage.EDGES, Stage.PROFILES, Stage.RESPONSE, Stage.PSF}
"""Stages that find something, so that the photo has to show something."""


def seek_edges(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:
    """Stage: straight edges, found or drawn, good and bad; none if nothing needs them."""
    if not edges_needed(have, options):
        return replace(have, edges=())
    extent = options.blur_extent or have.extent
    if extent is None:
        extent = yield from estimating_blur_extent(have.photo)
        have = have.choosing(blur_extent=extent)
    if options.edges is None:
        edges = yield from finding_edges(have.photo, blur_extent=extent)
    else:
        edges = yield from _refining(have.photo, options.edges, extent)
    return replace(have, extent=extent, edges=edges)


def sample(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:
    """Stage: intensity across the good edges, in groups that suit the estimate."""
    edges = made(have.edges, "edges")
    groups: list[ProfileGroup] = []
    if edges:
        groups = yield from sampling_profiles(
            have.photo, edges, grouping=ByOrientation(), index=have.index
        )
    return replace(have, groups=options.response.arranged(groups))


def find_response(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:
    """Stage: the response of the camera, of all channels or of each."""
    groups = made(have.groups, "profiles")
    return replace(have, response=(yield from estimating_responses(groups, options.response)))


def undo_response(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:  # noqa: ARG001 - every stage takes both
    """Stage: the photo in linear light."""
    curve = made(have.response, "a response").curve
    flat = yield from linearizing(in_rows(have.colors, have.axes), curve)
    return replace(have, linear=flat.reshape(have.colors.shape))


def find_psf(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:
    """Stage: the PSF of the whole photo, from the picture or from its edges."""
    method = options.psf
    if method is None:
        method = suited_estimator(have.photo, options.blur_extent)
        have = have.choosing(psf=method)
    evidence = yield from _evidence(have, method)
    return replace(have, psf=(yield from estimating_psf(evidence, method)))


def settle_light(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:
    """Stage: the light in which the PSF restores without ringing, where the response is a guess."""
    response, psf = made(have.response, "a response"), made(have.psf, "a PSF").psf
    if not options.settle_light or response.certain or have.axes != PLANE or psf.ndim != PLANE:
        return replace(have, trial=LightTrial())
    linear, recorded = made(have.linear, "linear light"), to_unit(have.colors)
    trial = yield from trying_light(linear, recorded, have.lamps, psf, DEFAULT_METHOD)
    have = replace(have, trial=trial)
    if not trial.prefers_recorded:
        return have
    settled = replace(have, response=taken_as_light(response), linear=None)
    return (yield from undo_response(settled, options))


def find_field(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:
    """Stage: the PSFs of all parts of the photo, if it is to be divided."""
    if options.psf is not None and options.psf.field is not None:
        return replace(have, field=options.psf.field)
    if options.regions is None:
        return have
    method = options.psf
    if method is None or not method.needs_picture:
        method = Variational()  # of parts, whose size the whole tells: one search is enough
    linear, whole = made(have.linear, "linear light"), made(have.psf, "a PSF")
    field = yield from estimating_psf_field(
        linear, method, whole, grid=options.regions, clipped=have.clipped
    )
    return replace(have, field=field)


def undo_blur(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:
    """Stage: deconvolved with the PSF of the whole, or with those of the parts."""
    linear, method = made(have.linear, "linear light"), options.method
    if method is None:
        method = DEFAULT_METHOD
        have = have.choosing(method=method)
    clipped, field, weights = have.lamps, have.field, have.worth
    middle = [(side - 1) / 2 for side in have.sides]
    psf = made(have.psf, "a PSF").psf if field is None else field.at(*middle)
    statistics = measure_channels(linear, psf, clipped)
    sharp: FloatArray
    if field is not None:
        sharp = yield from deconvolving_varying(
            linear, field, method, clipped=clipped, weights=weights
        )
    else:
        sharp = yield from deconvolving(
            linear, psf, method, clipped=clipped, weights=weights, statistics=statistics
        )
    judged = yield from judging(
        linear,
        sharp,
        psf,
        clipped=clipped,
        statistics=statistics,
        slope_errors=[own.slope_error for own in made(have.response, "a response").estimates],
        guarded=options.guard,
    )
    return replace(have, sharp_linear=judged.sharp, trust=judged.trust)


def apply_response(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:  # noqa: ARG001 - every stage takes both
    """Stage: the response applied again, in the kind of the photo, its alpha kept."""
    sharp, curve = made(have.sharp_linear, "sharp light"), made(have.response, "a response").curve
    flat = yield from reapplying(in_rows(sharp, have.axes), curve, have.photo.dtype)
    colors: Image = flat.reshape(sharp.shape)
    whole = colors if have.alpha is None else np.concatenate([colors, have.alpha], axis=-1)
    return replace(have, result=whole)


Run: TypeAlias = Callable[[Intermediates, DeblurOptions], Job[Intermediates]]
"""What a stage does: a job that adds what it makes."""

PATH: Mapping[Stage, Run] = MappingProxyType(
    {
        Stage.EDGES: seek_edges,
        Stage.PROFILES: sample,
        Stage.RESPONSE: find_response,
        Stage.LINEAR: undo_response,
        Stage.PSF: find_psf,
        Stage.TRIAL: settle_light,
        Stage.FIELD: find_field,
        Stage.RESTORE: undo_blur,
        Stage.REAPPLY: apply_response,
    }
)
"""The stages in order."""


def walking(
    have: Intermediates,
    options: DeblurOptions,
    *,
    start: Stage = Stage.EDGES,
    until: Stage = Stage.REAPPLY,
    replaced: Mapping[Stage, Run] | None = None,
    observe: Callable[[Stage, Intermediates], object] | None = None,
) -> Job[Intermediates]:
    """Long job: go along the path, from what there is already to the stage `until`.

    Parameters
    ----------
    have : Intermediates
        The photo, and whatever is known already: a stage whose product is there is skipped.
    options : DeblurOptions
        What is known besides, and the methods for the rest.
    start, until : Stage
        The first stage and the last one; those before and after are passed over.
    replaced : mapping of Stage to callable, optional
        Functions in the place of some stages.
    observe : callable, optional
        Called after each stage with it and with what there is by then.

    Raises
    ------
    CrfDeblurError
        The photo does not permit a stage; the message says what to do.
    ValueError
        Not a photo, or options of another kind.
    """
    arguments.instance(have, Intermediates, "Intermediates")
    for stage in (start, until):
        arguments.instance(stage, Stage, "a Stage")
    stages = list(Stage)
    ahead = stages[stages.index(start) : stages.index(until) + 1]
    _check(have, options, [stage for stage in ahead if not stage.is_done(have)])
    path = {**PATH, **(replaced or {})}
    for stage in ahead:
        if not stage.is_done(have):
            have = yield from path[stage](have, options)
            if observe is not None:
                observe(stage, have)
    return have


def edges_needed(have: Intermediates, options: DeblurOptions) -> bool:
    """Whether edges have to be looked for: for the response, or for a PSF from them alone."""
    arguments.instance(have, Intermediates, "Intermediates")
    arguments.instance(options, DeblurOptions, "DeblurOptions")
    for_response = have.response is None and options.response.needs_profiles
    for_psf = have.psf is None and options.psf is not None and options.psf.needs_edges
    return for_response or for_psf


def suited_estimator(photo: Image, extent: float | None) -> PsfEstimator:
    """Blind estimation of a PSF of unknown size, or of one a little larger than a known blur.

    Parameters
    ----------
    photo : ndarray, shape (M, N) or (M, N, C)
        Photo or linear image: how large a PSF it permits.
    extent : float, optional
        Largest width of a blurred edge in pixels.
    """
    if extent is not None:
        arguments.number(extent, "a blur extent in pixels", above=0)
    photo = arguments.array(photo, "a photo (M, N) or (M, N, C)", axes=(2, 3))
    largest = min(photo.shape[:2]) // 3
    if largest < 3:
        raise CrfDeblurError("the image is too small to find its blur; give the PSF")
    if extent is None:
        return Portfolio()
    # Room for what hides in the noise at both ends of an edge.
    size = 2 * round(1.15 * extent / 2 + 1) + 1
    return Portfolio(size=min(size, (largest - 1) // 2 * 2 + 1))


def _check(have: Intermediates, options: DeblurOptions, ahead: Sequence[Stage]) -> None:
    """Refuse a photo from which nothing can be found, or whose values are none."""
    arguments.instance(options, DeblurOptions, "DeblurOptions")
    if have.axes == PLANE and SEEKING & {*ahead}:
        check_photo(have.photo)
        options.check_for(have.sides, have.channels)
    else:
        check_intensities(have.colors)


def _refining(photo: Image, drawn: tuple[Drawn, ...], extent: float) -> Job[tuple[Edge, ...]]:
    """Job: what was drawn refined on the photo, measured edges as they are, in their order."""
    rough = [own for own in drawn if not isinstance(own, Edge)]
    refined = iter((yield from refining_edges(photo, rough, blur_extent=extent)))
    return tuple(own if isinstance(own, Edge) else next(refined) for own in drawn)


def _evidence(have: Intermediates, method: PsfEstimator) -> Job[Evidence]:
    """Job: what a method looks at."""
    linear, clipped = (have.linear, have.clipped) if have.axes == PLANE else (None, None)
    certain = have.response is None or have.response.certain
    if not method.needs_edges:
        return Evidence(linear, clipped, certain=certain)
    narrow = yield from sampling_profiles(have.colors, made(have.edges, "edges"), grouping=NARROW)
    response = made(have.response, "a response").curve
    return Evidence(linear, clipped, tuple(narrow), response, certain)
