"""Plots of the response: its curve, and the profiles as recorded and in linear light."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from magicgui.widgets import ComboBox, Container
from magicgui.widgets.bases import Widget

from ...io import read_responses
from ...profiles import ProfileGroup
from ...report import draw_profiles, draw_response, move_curves, move_profiles
from ...report.content import channel_names, direction
from ...response import Gamma, ResponseCurve
from ..session.facade import Session
from .base import Followed
from .forms import tight
from .plots import Plot, palette_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

LEAST_HEIGHT = 120  # pixels of a plot in a small window; all three grow with it


class ResponsePlots(Container[Widget]):
    """The curve that is in force or tried out, and what it makes of the profiles.

    Parameters
    ----------
    session : Session
        Whose response and edges are drawn.
    tuned : callable
        Gives the curves that are tuned by hand; none while nothing is.
    """

    def __init__(self, session: Session, tuned: Callable[[], tuple[ResponseCurve, ...]]) -> None:
        super().__init__(labels=False)
        self.margins = (0, 0, 0, 0)
        self._session, self._tuned = session, tuned
        self._compared: dict[str, ResponseCurve] = {}
        self.group = ComboBox(
            label="profiles of group",
            choices=self._groups,
            tooltip="edges of one orientation; follows the edge that is selected",
        )
        self.group.changed.connect(self._redraw_profiles)
        viewer = session.viewer
        self.curve = Plot(viewer, self._draw_curve, height=LEAST_HEIGHT)
        self.recorded = Plot(viewer, self._draw_recorded, height=LEAST_HEIGHT)
        self.linear = Plot(viewer, self._draw_linear, height=LEAST_HEIGHT)
        profiles = tight(self.recorded, self.linear, layout="horizontal")
        for wide in (self, profiles):  # plots take the room that controls leave
            wide.native.setSizePolicy(self.curve.native.sizePolicy())
        self.extend([self.curve, tight(self.group, labels=True), profiles])

    @property
    def compares(self) -> bool:
        """Whether curves of a file are drawn beside that of the photo."""
        return bool(self._compared)

    def compare(self, path: Path | None) -> None:
        """Draw the response in a JSON file beside that of the photo; None draws no other."""
        curves = read_responses(path) if path else ()
        names = [f"{path.stem if path else ''} {n}".strip() for n in channel_names(len(curves))]
        self._compared = dict(zip(names, curves, strict=False))
        self.curve.redraw()

    def followed(self) -> Followed:
        """Signals that the plots show, and what each of them calls."""
        session = self._session
        return [
            (session.response_changed, self.redraw_curves),
            (session.edges_changed, self._edges_changed),
            (session.selection_changed, self._show_group_of),
        ]

    def redraw_curves(self) -> None:
        """Draw another response."""
        self.curve.redraw()
        self.linear.redraw()

    def move_curves(self) -> None:
        """Follow the sliders."""
        curves, group = self._curves(), self._chosen_group()
        if self._tuned():
            self.curve.move(lambda lines: move_curves(lines, curves))
        if group is not None and curves:
            self.linear.move(lambda lines: move_profiles(lines[0], group, curves))

    def _redraw_profiles(self) -> None:
        self.recorded.redraw()
        self.linear.redraw()

    def _edges_changed(self) -> None:
        self.group.reset_choices()
        self._redraw_profiles()

    def _show_group_of(self, number: int | None) -> None:
        """Show the group of the selected edge."""
        edges = self._session.state.edges
        group = -1 if edges is None or number is None else edges.group_numbers[number]
        if group >= 0:
            self.group.value = group

    def _groups(self, _: Any) -> list[tuple[str, int]]:
        edges = self._session.state.edges
        return [
            (f"{number}: edges at {direction(group)}, {len(group)} profiles", number - 1)
            for number, group in enumerate(edges.groups if edges else (), start=1)
        ]

    def _chosen_group(self) -> ProfileGroup | None:
        edges, number = self._session.state.edges, self.group.value
        return None if edges is None or number is None else edges.groups[number]

    def _curves(self) -> Sequence[ResponseCurve]:
        """The response as it is, or as it is tuned."""
        shown = self._session.state.shown
        return self._tuned() or [e.curve for e in (shown.estimates if shown else ())]

    def _draw_curve(self, ax: "Axes") -> "Sequence[Artist]":
        shown, palette = self._session.state.shown, palette_of(self._session.viewer)
        estimates = shown.estimates if shown else ()
        references = {"gamma 2.2": Gamma(2.2)} | self._compared
        return draw_response(ax, estimates, references, tuned=self._tuned(), palette=palette)

    def _draw_recorded(self, ax: "Axes") -> "Sequence[Artist]":
        group = self._chosen_group()
        if group is None:
            return _note(ax, "no profiles yet:\nfind or draw edges")
        return [draw_profiles(ax, group, palette=palette_of(self._session.viewer))]

    def _draw_linear(self, ax: "Axes") -> "Sequence[Artist]":
        group, curves = self._chosen_group(), self._curves()
        if group is None or not curves:
            return _note(ax, "no response yet")
        return [draw_profiles(ax, group, curves, palette=palette_of(self._session.viewer))]


def _note(ax: "Axes", text: str) -> "Sequence[Artist]":
    """Say on empty axes why they are empty."""
    ax.set_axis_off()
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", fontsize=8)
    return []
