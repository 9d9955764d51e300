"""How what is known of a photo can be found again: its record."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ...deconvolution import Deconvolver
from ...deconvolution.tiles import Region
from ...pipeline import DeblurOptions, PhotoStack, Pixels, Record, Stage
from ...psf import GivenPsf
from ..regions import pairs, stack_index
from .state import EdgeSet, Fitted, State


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """The options by which something is found again, and the slice in which it is found."""

    options: DeblurOptions
    plane: Region | None = None


def way_of(state: State, fitted: Fitted | None = None, method: Deconvolver | None = None) -> Way:
    """How all that is known can be found again from the photo alone, in full.

    What cannot be found again, since what it came from has changed meanwhile or is not in the
    photo, is given as it is.

    Parameters
    ----------
    state : State
    fitted : Fitted, optional
        The response that counts; by default the one in force.
    method : Deconvolver, optional
        How the blur was undone, if it was.
    """
    fitted = fitted or state.fitted
    if fitted is None:
        return _with_edges(Way(DeblurOptions()), state.edges)
    found = fitted.way.needs_profiles  # by trial it would have been settled, and given as it is
    way = Way(DeblurOptions(response=fitted.way, method=method, settle_light=not found))
    if found:
        way = _with_edges(way, fitted.edges)
    return way if state.psf is None else _with_psf(way, state, fitted)


def record_of(
    source: PhotoStack,
    way: Way,
    until: Stage,
    *,
    region: Region | None = None,
    photo: Pixels | None = None,
    result: Pixels | None = None,
    chosen: Mapping[str, Any] | None = None,
    tiled: bool = False,
) -> Record:
    """The record of something that was found or made in a session.

    Parameters
    ----------
    source : PhotoStack
        The photo.
    way : Way
    until : Stage
        How far.
    region : tuple of slice, optional
        What was restored, if it is not all.
    photo, result : Pixels, optional
        What went in, as far as that was read in full, and what came out.
    chosen : mapping, optional
        What was chosen automatically.
    tiled : bool
        Whether the blur was undone in tiles.
    """
    shape = tuple(int(side) for side in source.data.shape)
    return Record(
        photo=photo or Pixels(source.name, "", shape, source.dtype.name),
        options=way.options,
        until=until,
        plane=() if way.plane is None else stack_index(way.plane),
        region=None if region is None or region == source.whole else pairs(region),
        white=source.white,
        tiled=tiled,
        chosen=dict(chosen or {}),
        result=result,
    )


def how_far(state: State) -> Stage:
    """The last stage of the path of which something is known."""
    known = (
        (Stage.REAPPLY, state.restored),
        (Stage.FIELD, state.psf),
        (Stage.RESPONSE, state.fitted),
        (Stage.PROFILES, state.edges),
    )
    return next((stage for stage, product in known if product is not None), Stage.EDGES)


def _with_edges(way: Way, edges: EdgeSet | None) -> Way:
    if edges is None:
        return way
    options = replace(way.options, edges=edges.drawn, blur_extent=edges.asked)
    return Way(options, edges.plane)


def _with_psf(way: Way, state: State, fitted: Fitted) -> Way:
    """With the PSF: as it was found, if that can be done again, or else as it is."""
    sought = state.sought
    if state.psf is None or sought is None or sought.fitted is not fitted:
        return _with_given_psf(way, state)
    if way.plane is not None and way.plane != sought.plane:
        return _with_given_psf(way, state)
    if sought.method.needs_edges:
        if fitted.way.needs_profiles and sought.edges is not fitted.edges:
            return _with_given_psf(way, state)
        way = _with_edges(way, sought.edges)
    options = replace(way.options, psf=sought.method, regions=sought.regions)
    return Way(options, sought.plane)


def _with_given_psf(way: Way, state: State) -> Way:
    psf = None if state.psf is None else GivenPsf(state.psf.psf, state.field)
    return replace(way, options=replace(way.options, psf=psf))
