"""Profiles and response curves, drawn on axes."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from .._typing import FloatArray
from ..estimate import ResponseEstimate, ResponseStatus
from ..profiles import ProfileGroup
from ..response import ResponseCurve
from .colors import PAPER, Palette
from .content import channel_names, direction, normalized, usual_curves

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

SMALL = 7.0  # points of the letters inside the axes
KNOTS = np.linspace(0, 1, 257)  # intensities at which curves are drawn
STYLES = ("--", "-", "-.", ":")  # of the curves to compare with


def draw_profiles(
    ax: "Axes",
    group: ProfileGroup,
    curves: Sequence[ResponseCurve] = (),
    *,
    palette: Palette = PAPER,
) -> "LineCollection":
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
    palette : Palette
        Colors for the ground of the axes.

    Returns
    -------
    LineCollection
        The profiles, for :func:`move_profiles`.
    """
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection

    first, last = palette.shades
    shades, width = colormaps["viridis"], last - first
    rows = _rows(group, curves)
    middles = group.sides.mean(axis=1)[np.diff(group.sides, axis=1)[:, 0] != 0]
    low, high = float(middles.min()), float(middles.max())
    places = (middles - low) / max(high - low, 1e-9)
    lines = LineCollection(rows, colors=shades(first + width * places), linewidths=0.8, alpha=0.85)
    ax.add_collection(lines)
    ax.set(xlim=group.position[[0, -1]], ylim=(-0.12, 1.12))
    scale = "linear light" if curves else "recorded intensity"
    _labels(ax, "distance across the edge (px)", f"{scale}, scaled", palette)
    said = f"{len(rows)} profiles,\nedges at {direction(group)}"
    ax.text(0.04, 0.97, said, transform=ax.transAxes, va="top", fontsize=SMALL, color=palette.pale)
    # An edge rises from the lower left to the upper right: the other corners are free.
    key = ax.inset_axes((0.58, 0.1, 0.36, 0.035))
    ramp = shades(np.linspace(first, last, 64))[None]
    key.imshow(ramp, aspect="auto", extent=(0, 1, 0, 1))
    key.set(xticks=[0, 1], xticklabels=[f"{low:.2f}", f"{high:.2f}"], yticks=[])
    key.tick_params(labelsize=SMALL - 1, labelcolor=palette.pale, length=0, pad=1.5)
    key.set_title("mean of both sides", fontsize=SMALL - 1, color=palette.pale, pad=2)
    key.spines[:].set_visible(False)
    return lines


def move_profiles(
    lines: "LineCollection", group: ProfileGroup, curves: Sequence[ResponseCurve]
) -> None:
    """Let the lines of :func:`draw_profiles` show the same group with other responses undone."""
    lines.set_segments(_rows(group, curves))


def draw_response(
    ax: "Axes",
    responses: Sequence[ResponseEstimate],
    references: Mapping[str, ResponseCurve] | None = None,
    *,
    tuned: Sequence[ResponseCurve] = (),
    palette: Palette = PAPER,
) -> "list[Line2D]":
    """Draw inverse responses with their bands beside curves that are often assumed.

    Parameters
    ----------
    ax : Axes
        Empty axes.
    responses : sequence of ResponseEstimate
        One for all channels, or one for each of red, green and blue.
    references : mapping of str to ResponseCurve, optional
        Curves to compare with, by name; gamma 2.2 and sRGB if not given.
    tuned : sequence of ResponseCurve
        The same responses tuned by hand.
    palette : Palette
        Colors for the ground of the axes.

    Returns
    -------
    list of Line2D
        The tuned curves, for :func:`move_curves`.
    """
    _draw_covered(ax, responses, palette)
    _draw_references(ax, usual_curves() if references is None else references, palette)
    shades = [palette.one] if len(responses) == 1 else palette.channels
    names = channel_names(len(responses))
    for estimate, shade, name in zip(responses, shades, names, strict=False):
        _draw_estimate(ax, estimate, shade, name)
    lines = []
    for number, (curve, shade) in enumerate(zip(tuned, shades, strict=False)):
        color = palette.ink if len(tuned) == 1 else shade
        label = "tuned" if number == 0 else None
        lines += ax.plot(KNOTS, curve.to_irradiance(KNOTS), color=color, linewidth=1.6, label=label)
        lines[-1].set_linestyle((0, (4, 1.5)))
    ax.set(xlim=(0, 1), ylim=(0, 1))
    _labels(ax, "recorded intensity", "relative irradiance", palette)
    ax.legend(
        loc="upper left",
        fontsize=SMALL,
        frameon=False,
        labelcolor=palette.ink,
        borderaxespad=0.3,
    )
    return lines


def move_curves(lines: "Sequence[Line2D]", curves: Sequence[ResponseCurve]) -> None:
    """Let the tuned lines of :func:`draw_response` show other curves."""
    for line, curve in zip(lines, curves, strict=True):
        line.set_ydata(curve.to_irradiance(np.asarray(line.get_xdata())))


def _rows(group: ProfileGroup, curves: Sequence[ResponseCurve]) -> list[FloatArray]:
    """Points of each profile, shape (M, 2)."""
    return [np.column_stack([group.position, row]) for row in normalized(group, curves)]


def _draw_references(ax: "Axes", references: Mapping[str, ResponseCurve], palette: Palette) -> None:
    """Draw the curves to compare with, as many as there are styles."""
    styles = zip(references.items(), palette.references, STYLES, strict=False)
    for (name, curve), shade, style in styles:
        ax.plot(KNOTS, curve.to_irradiance(KNOTS), style, color=shade, linewidth=0.9, label=name)


def _draw_estimate(ax: "Axes", estimate: ResponseEstimate, shade: str, name: str) -> None:
    """Draw a response and its band, named after its channel if it has one."""
    given = estimate.status is ResponseStatus.GIVEN
    own = name or ("given" if given else "estimate")
    ax.plot(KNOTS, estimate.curve.to_irradiance(KNOTS), color=shade, linewidth=1.6, label=own)
    if not given:
        band = estimate.intensity, estimate.lower, estimate.upper
        label = None if name else "95 % band"
        ax.fill_between(*band, color=shade, alpha=0.22, linewidth=0, label=label)


def _draw_covered(ax: "Axes", responses: Sequence[ResponseEstimate], palette: Palette) -> None:
    """Shade the intensities that the edges of every channel cover."""
    estimated = [r.covered for r in responses if r.status is not ResponseStatus.GIVEN]
    if not estimated:
        return
    low, high = max(c[0] for c in estimated), min(c[1] for c in estimated)
    if low < high:
        ax.axvspan(low, high, color=palette.covered, linewidth=0, label="covered by edges")


def _labels(ax: "Axes", x: str, y: str, palette: Palette) -> None:
    ax.set_xlabel(x, fontsize=7.5, color=palette.ink)
    ax.set_ylabel(y, fontsize=7.5, color=palette.ink)
    ax.tick_params(labelsize=SMALL, labelcolor=palette.pale, length=2, color=palette.pale)
    ax.spines[:].set(linewidth=0.5, color=palette.pale)
    ax.spines[["top", "right"]].set_visible(False)
