"""Plots in a widget: drawn when they can be seen, once for many changes, readable in all themes."""

from collections.abc import Iterator

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from napari.utils.theme import get_theme

from napari_crfdeblur._napari.docks.plots import Plot, palette_of


class Sine:
    """A wave of some height, and how often it was drawn."""

    def __init__(self) -> None:
        self.height, self.drawn = 1.0, 0
        self.x = np.linspace(0, 6, 50)

    def draw(self, ax):
        self.drawn += 1
        ax.set(xlim=(0, 6), ylim=(-3, 3), xlabel="x (px)")
        return ax.plot(self.x, self.height * np.sin(self.x), "red", linewidth=2)

    def change(self, lines):
        lines[0].set_ydata(self.height * np.sin(self.x))


@pytest.fixture
def sine() -> Sine:
    return Sine()


@pytest.fixture
def plot(viewer, sine, qapp) -> Iterator[Plot]:  # noqa: ARG001 - there is no widget without it
    plot = Plot(viewer, sine.draw)
    plot.native.resize(300, 210)
    yield plot
    plot.native.close()


def shown(plot, qtbot):
    plot.native.show()
    qtbot.waitUntil(lambda: plot._ground is not None)
    qtbot.wait(50)


def pixels(plot):
    return np.asarray(plot.canvas.buffer_rgba()).copy()


def luminance(color):
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(color)]
    return float(np.dot((0.2126, 0.7152, 0.0722), linear))


def contrast(one, other):
    """Ratio of WCAG 2.2; 3 is asked for of graphics, 4.5 of small text."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_axes_show_the_present_state_without_waiting(plot, sine):
    sine.height = 2.0
    plot.redraw()
    assert plot.axes.lines[0].get_ydata().max() == pytest.approx(2, abs=0.01)
    assert plot.figure.axes == [plot.axes]


def test_many_changes_are_drawn_once(plot, sine, qtbot):
    shown(plot, qtbot)
    before = sine.drawn
    for _ in range(5):
        plot.redraw()
    qtbot.waitUntil(lambda: sine.drawn > before)
    qtbot.wait(50)
    assert sine.drawn == before + 1


def test_a_hidden_plot_waits_until_it_is_shown(plot, sine, qtbot):
    qtbot.wait(50)
    assert sine.drawn == 0
    shown(plot, qtbot)
    assert sine.drawn > 0


def test_moving_gives_the_picture_of_drawing_anew(plot, sine, qtbot):
    shown(plot, qtbot)
    before, drawn = pixels(plot), sine.drawn
    sine.height = 2.5
    plot.move(sine.change)
    moved = pixels(plot)
    assert sine.drawn == drawn
    assert not np.array_equal(moved, before)
    plot.redraw()
    qtbot.waitUntil(lambda: sine.drawn > drawn)
    qtbot.wait(50)
    np.testing.assert_array_equal(pixels(plot), moved)


def test_a_plot_has_the_colors_of_the_theme(plot, viewer):
    for name in ("light", "dark"):
        viewer.theme = name
        theme = get_theme(name)
        assert plot.axes.get_facecolor()[:3] == pytest.approx(to_rgb(theme.canvas.as_hex()))
        assert plot.axes.xaxis.label.get_color() == theme.text.as_hex()


@pytest.mark.parametrize("name", ["dark", "light"])
def test_curves_and_letters_can_be_read_in_every_theme(viewer, name):
    viewer.theme = name
    palette, ground = palette_of(viewer), get_theme(name).canvas.as_hex()
    assert contrast(palette.ink, ground) > 4.5
    assert contrast(palette.pale, ground) > 4.5
    for color in (palette.one, *palette.channels):
        assert contrast(color, ground) > 3
        assert contrast(color, palette.covered) > 2.5


def test_a_plot_that_was_closed_is_left_alone(viewer, sine, qtbot):
    plot = Plot(viewer, sine.draw)
    plot.native.resize(300, 210)
    shown(plot, qtbot)
    plot.native.deleteLater()
    qtbot.wait(50)
    plot.redraw()
    qtbot.wait(50)
