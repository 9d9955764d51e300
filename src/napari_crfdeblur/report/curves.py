"""Profiles and response curves, drawn on axes."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..estimate import ResponseEstimate, ResponseStatus
from ..profiles import ProfileGroup
from ..response import ResponseCurve
from .colors import CHANNELS, COVERED, INK, ONE, PALE, REFERENCES
from .content import channel_names, direction, normalized, usual_curves

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SMALL = 7.0  # points of the letters inside the axes


def draw_profiles(ax: "Axes", group: ProfileGroup, curves: Sequence[ResponseCurve] = ()) -> None:
    """Draw the profiles of a group, each scaled from 0 on one side to 1 on the other.

    With the right response undone they fall on one another.

    Parameters
    ----------
    ax : Axes
        Empty axes.
    group : ProfileGroup
        Profiles of one orientation; dark edges are drawn in dark blue, bright ones in green.
    curves : sequence of ResponseCurve
        One for all channels or one for each, undone first; none shows what was recorded.
    """
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection

    shades = colormaps["viridis"]
    profiles = normalized(group, curves)
    middles = group.sides.mean(axis=1)[np.diff(group.sides, axis=1)[:, 0] != 0]
    low, high = float(middles.min()), float(middles.max())
    places = (middles - low) / max(high - low, 1e-9)
    rows = [np.column_stack([group.position, profile]) for profile in profiles]
    # The yellow end of the color map is too faint on white.
    ax.add_collection(
        LineCollection(rows, colors=shades(0.88 * places), linewidths=0.8, alpha=0.85)
    )
    ax.set(xlim=group.position[[0, -1]], ylim=(-0.12, 1.12))
    scale = "linear light" if curves else "recorded intensity"
    _labels(ax, "distance across the edge (px)", f"{scale}, scaled")
    said = f"{len(rows)} profiles,\nedges at {direction(group)}"
    ax.text(0.04, 0.97, said, transform=ax.transAxes, va="top", fontsize=SMALL, color=PALE)
    # An edge rises from the lower left to the upper right: the other corners are free.
    key = ax.inset_axes((0.58, 0.1, 0.36, 0.035))
    key.imshow(shades(0.88 * np.linspace(0, 1, 64))[None], aspect="auto", extent=(0, 1, 0, 1))
    key.set(xticks=[0, 1], xticklabels=[f"{low:.2f}", f"{high:.2f}"], yticks=[])
    key.tick_params(labelsize=SMALL - 1, labelcolor=PALE, length=0, pad=1.5)
    key.set_title("mean of both sides", fontsize=SMALL - 1, color=PALE, pad=2)
    key.spines[:].set_visible(False)


def draw_response(
    ax: "Axes",
    responses: Sequence[ResponseEstimate],
    references: Mapping[str, ResponseCurve] | None = None,
) -> None:
    """Draw inverse responses with their bands beside curves that are often assumed.

    Parameters
    ----------
    ax : Axes
        Empty axes.
    responses : sequence of ResponseEstimate
        One for all channels, or one for each of red, green and blue.
    references : mapping of str to ResponseCurve, optional
        Curves to compare with, by name; gamma 2.2 and sRGB if not given.
    """
    _draw_covered(ax, responses)
    intensity = np.linspace(0, 1, 257)
    for (name, curve), shade, style in zip(
        (usual_curves() if references is None else references).items(),
        REFERENCES,
        ("--", "-", "-."),
        strict=False,
    ):
        irradiance = curve.to_irradiance(intensity)
        ax.plot(intensity, irradiance, style, color=shade, linewidth=0.9, label=name)
    shades = [ONE] if len(responses) == 1 else CHANNELS
    names = channel_names(len(responses))
    for estimate, shade, name in zip(responses, shades, names, strict=False):
        given = estimate.status is ResponseStatus.GIVEN
        own = name or ("given" if given else "estimate")
        irradiance = estimate.curve.to_irradiance(intensity)
        ax.plot(intensity, irradiance, color=shade, linewidth=1.6, label=own)
        if not given:
            band = estimate.intensity, estimate.lower, estimate.upper
            label = "95 % band" if len(responses) == 1 else None
            ax.fill_between(*band, color=shade, alpha=0.22, linewidth=0, label=label)
    ax.set(xlim=(0, 1), ylim=(0, 1))
    _labels(ax, "recorded intensity", "relative irradiance")
    ax.legend(loc="upper left", fontsize=SMALL, frameon=False, labelcolor=INK, borderaxespad=0.3)


def _draw_covered(ax: "Axes", responses: Sequence[ResponseEstimate]) -> None:
    """Shade the intensities that the edges of every channel cover."""
    estimated = [r.covered for r in responses if r.status is not ResponseStatus.GIVEN]
    if not estimated:
        return
    low, high = max(c[0] for c in estimated), min(c[1] for c in estimated)
    if low < high:
        ax.axvspan(low, high, color=COVERED, linewidth=0, label="covered by edges")


def _labels(ax: "Axes", x: str, y: str) -> None:
    ax.set_xlabel(x, fontsize=7.5, color=INK)
    ax.set_ylabel(y, fontsize=7.5, color=INK)
    ax.tick_params(labelsize=SMALL, labelcolor=PALE, length=2, color=PALE)
    ax.spines[:].set(linewidth=0.5, color=PALE)
    ax.spines[["top", "right"]].set_visible(False)
