"""The whole workflow clicked through in a window: what users see, in both themes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from magicgui.widgets import PushButton
from napari.components import ViewerModel
from napari.utils.theme import get_theme
from pytestqt.qtbot import QtBot
from qtpy.QtCore import Qt

from napari_crfdeblur import Session
from napari_crfdeblur._napari.docks import (
    BatchDock,
    BlurDock,
    DeblurDock,
    EdgesDock,
    ResponseDock,
    RestoreDock,
)
from napari_crfdeblur._napari.docks.base import SHADES, Dock
from napari_crfdeblur._napari.docks.plots import Plot
from napari_crfdeblur._napari.session.state import State
from napari_crfdeblur.simulate import Simulated

LONG = 60000  # milliseconds: only a broken run takes as long
CLICKS = (
    (EdgesDock, "Find edges"),
    (ResponseDock, "Estimate the response"),
    (RestoreDock, "Linearize"),
    (BlurDock, "Estimate the PSF"),
    (RestoreDock, "Deconvolve"),
    (RestoreDock, "Re-apply"),
)


def click(qtbot: QtBot, dock: Dock, text: str) -> None:
    """Press a button with the mouse, and wait for the end of what it starts."""
    kind = type(PushButton().native)
    (button,) = [b for b in dock.native.findChildren(kind) if b.text() == text]
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: dock.runner.idle, timeout=LONG)


def pixels(viewer: Any, path: Path) -> np.ndarray:
    """The window as it is on the screen, (M, N, 4) uint8."""
    return np.asarray(viewer.screenshot(path, canvas_only=False, flash=False))


def test_the_workflow_in_a_window_gives_the_numbers_of_the_script(
    qtbot: QtBot,
    make_napari_viewer: Any,
    blurred: Simulated,
    done: Session,
    tmp_path: Path,
) -> None:
    viewer = make_napari_viewer(show=True)
    viewer.window.resize(1300, 900)
    viewer.add_image(blurred.photo, name="panels")
    docks = {kind: kind(viewer) for kind, _ in CLICKS}
    for dock in docks.values():
        viewer.window.add_dock_widget(dock, tabify=True)
    for kind, text in CLICKS:
        docks[kind].native.parent().raise_()
        click(qtbot, docks[kind], text)
        qtbot.wait(100)  # plots are drawn one after the other
        shown = pixels(viewer, tmp_path / f"{text}.png")
        assert shown[..., :3].std() > 10, "the window is blank"

    for layer in done.viewer.layers:
        mine = viewer.layers[layer.name]
        np.testing.assert_array_equal(np.asarray(mine.data), np.asarray(layer.data))
        assert mine.metadata == layer.metadata
    names = {layer.name for layer in done.viewer.layers}
    assert {layer.name for layer in viewer.layers} == names


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_what_was_found_is_shown_in_every_dock(
    qtbot: QtBot,
    make_napari_viewer: Any,
    blurred: Simulated,
    done: Session,
    tmp_path: Path,
    theme: str,
) -> None:
    viewer = make_napari_viewer(show=True)
    viewer.theme = theme
    viewer.window.resize(1300, 900)
    photo = viewer.add_image(blurred.photo, name="panels")
    docks = [kind(viewer) for kind in (EdgesDock, ResponseDock, BlurDock, RestoreDock)]
    for dock in docks:
        viewer.window.add_dock_widget(dock, tabify=True)
    found = done.state
    docks[0].session.commit(photo, State(found.edges, found.fitted, found.psf))
    shown = []
    for dock in docks:
        dock.native.parent().raise_()
        qtbot.wait(100)  # plots are drawn one after the other
        shown.append(pixels(viewer, tmp_path / "shown.png"))
        assert shown[-1][..., :3].std() > 10, "the window is blank"
    assert not any(np.array_equal(shown[0], other) for other in shown[1:])


def test_the_theme_changes_the_plots(
    qtbot: QtBot, make_napari_viewer: Any, session: Session
) -> None:
    viewer = make_napari_viewer(show=True)
    viewer.add_image(session.photo.data, name="panels")
    dock = EdgesDock(viewer)
    viewer.window.add_dock_widget(dock)
    plot = next(widget for widget in dock.controls if isinstance(widget, Plot))
    grounds = []
    for theme in ("dark", "light"):
        viewer.theme = theme
        qtbot.wait(50)
        grounds.append(np.mean(plot.figure.get_facecolor()[:3]))
    assert grounds[0] < 0.3 < 0.7 < grounds[1]


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_messages_can_be_read_on_both_themes(theme: str) -> None:
    ground = get_theme(theme).background.as_rgb_tuple()
    for shade in SHADES[theme].values():
        ink = tuple(int(shade[i : i + 2], 16) for i in (1, 3, 5))
        # The least that WCAG 2.1 asks for of text.
        assert contrast(ink, ground[:3]) >= 4.5


@pytest.mark.parametrize(
    "kind", [EdgesDock, ResponseDock, BlurDock, RestoreDock, DeblurDock, BatchDock]
)
def test_every_control_says_what_it_is(qtbot: QtBot, viewer: ViewerModel, kind: Any) -> None:
    silent = []
    dock = kind(viewer)
    qtbot.addWidget(dock.native)
    seen = [dock.controls]
    while seen:
        widget = seen.pop()
        inner = list(widget) if hasattr(widget, "__iter__") and hasattr(widget, "layout") else []
        seen += inner
        asks = hasattr(widget, "value") and type(widget).__name__ != "Label"
        if asks and not inner and not widget.tooltip:
            silent.append(f"{type(widget).__name__} {widget.label or widget.name}")
    assert not silent


def contrast(one: tuple[int, ...], two: tuple[int, ...]) -> float:
    """Ratio of luminances as of WCAG 2.1."""
    light, dark = sorted((luminance(one), luminance(two)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def luminance(color: tuple[int, ...]) -> float:
    from napari_crfdeblur.response import SRGB

    return float(SRGB().to_irradiance(np.array(color) / 255) @ [0.2126, 0.7152, 0.0722])
