"""What a street is built of: houses, windows, shops, posters, bricks."""

from collections.abc import Sequence
from math import tau

import numpy as np
from numpy.random import Generator

from .perspective import Box, Surface

FRAME, GLASS, SHINE = "#f7f3e8", "#2b4256", "#8fb3c7"
ACCENTS = ("#1f6f78", "#b23a48", "#2d4a7c", "#e07a2f", "#3f6b3a", "#6a3d6e")
POSTERS = (
    ("#f2b632", "#23395b", "#d1495b", "OPERA"),
    ("#23788c", "#f6e7c1", "#f2a541", "CINEMA"),
    ("#d9483b", "#fbf3dd", "#1f2d3d", "MUSEUM"),
    ("#4b3f72", "#f6e7c1", "#f2a541", "JAZZ"),
)
SHOPS = ("BAKERY", "FLOWERS", "BOOKS", "CAFE")


def house(wall: Surface, color: str, name: str, rng: Generator) -> None:
    """A house of three floors above a shop, on a surface of its own."""
    wall.panel((0, 0, 1, 1), color)
    wall.panel((0, 0, 1, 0.035), FRAME)
    shutter = ACCENTS[rng.integers(len(ACCENTS))]
    for top in (0.10, 0.31, 0.52):
        for left in (0.19, 0.63):
            window(wall, (left, top, left + 0.18, top + 0.13), shutter)
    shop(wall.part((0, 0.70, 1, 1)), name, rng)


def window(wall: Surface, box: Box, shutter: str) -> None:
    """A window with bars, a sill and shutters on both sides."""
    left, top, right, bottom = box
    width = right - left
    for x in (left - 0.58 * width, right + 0.08 * width):
        wall.panel((x, top, x + 0.5 * width, bottom), shutter)
    frame = wall.panel((left, top, right, bottom), FRAME)
    glazing(frame, columns=2, rows=3)
    wall.panel((left - 0.06 * width, bottom, right + 0.06 * width, bottom + 0.012), FRAME)


def glazing(frame: Surface, *, columns: int, rows: int) -> None:
    """Panes between bars, the sky reflected in them from corner to corner."""
    for column, row in np.ndindex(columns, rows):
        x, y = 0.06 + 0.94 * column / columns, 0.05 + 0.95 * row / rows
        pane = frame.panel((x, y, x + 0.94 / columns - 0.06, y + 0.95 / rows - 0.05), GLASS)
        pane.shape([(0, 0), (0.7, 0), (0, 0.8)], SHINE, opacity=0.55)


def shop(front: Surface, name: str, rng: Generator) -> None:
    """A shop: sign, striped awning, window and door."""
    color = ACCENTS[rng.integers(len(ACCENTS))]
    front.panel((0, 0, 1, 1), FRAME)
    sign = front.panel((0, 0, 1, 0.20), color)
    sign.text(name, (0.2, 0.25, 0.8, 0.75), FRAME)
    display = front.panel((0.07, 0.30, 0.62, 0.84), GLASS)
    display.shape([(0.1, 0), (0.5, 0), (0.2, 1), (0, 1), (0, 0.3)], SHINE, opacity=0.35)
    door = front.panel((0.70, 0.30, 0.93, 1), color)
    door.panel((0.18, 0.10, 0.82, 0.55), GLASS)
    awning(front, (0.02, 0.20, 0.98, 0.44), color)


def awning(front: Surface, box: Box, color: str, stripes: int = 9) -> None:
    """A sun blind of stripes that spread towards its lower edge."""
    left, top, right, bottom = box
    upper, lower = (
        np.linspace(left, right, stripes + 1),
        np.linspace(left - 0.05, right, stripes + 1),
    )
    for i in range(stripes):
        corners = [(upper[i], top), (upper[i + 1], top), (lower[i + 1], bottom), (lower[i], bottom)]
        front.facet(corners, FRAME if i % 2 else color)


def corner_building(wall: Surface, rng: Generator) -> None:
    """A building in the shade with two large posters above a book shop of bricks."""
    wall.panel((0, 0, 1, 1), "#cdb79a")
    wall.panel((0, 0, 1, 0.03), FRAME)
    first, second = rng.permutation(len(POSTERS))[:2]
    poster(wall, (0.09, 0.09, 0.50, 0.62), POSTERS[first])
    poster(wall, (0.62, 0.13, 0.90, 0.52), POSTERS[second])
    bricks(wall, (0, 0.70, 1, 1), rng)
    sign = wall.panel((0.06, 0.725, 0.94, 0.79), "#24473c")
    sign.text("BOOKS AND MAPS", (0.12, 0.25, 0.88, 0.75), "#f3d9a0")
    for left in (0.08, 0.40, 0.70):
        frame = wall.panel((left, 0.81, left + 0.24, 0.955), FRAME)
        glazing(frame, columns=3, rows=2)


def poster(wall: Surface, box: Box, design: Sequence[str]) -> None:
    """A poster: colored sheet, sun, hill, title and lines of small print."""
    paper, ink, spot, title = design
    sheet = wall.panel(box, paper)
    angles = np.linspace(0, tau, 60, endpoint=False)
    sun = np.column_stack([0.62 + 0.22 * np.cos(angles), 0.44 + 0.14 * np.sin(angles)])
    sheet.shape(sun, spot)
    sheet.facet([(0, 0.72), (0.38, 0.50), (0.62, 0.66), (1, 0.46), (1, 0.80), (0, 0.80)], ink)
    sheet.text(title, (0.12, 0.09, 0.88, 0.22), ink)
    sheet.text("EVERY NIGHT AT EIGHT", (0.12, 0.85, 0.88, 0.89), ink)
    sheet.text("TICKETS AT THE DOOR", (0.12, 0.92, 0.70, 0.955), ink)


def bricks(wall: Surface, box: Box, rng: Generator, *, rows: int = 18, columns: int = 26) -> None:
    """Brickwork: rows shifted by half a brick, every brick of another tone."""
    left, top, right, bottom = box
    wall.shape([(left, top), (right, top), (right, bottom), (left, bottom)], "#c9b8a8")
    tones = ("#9c4a38", "#ab5741", "#8d4334", "#b5634b", "#a04f43")
    dx, dy = (right - left) / columns, (bottom - top) / rows
    for row, column in np.ndindex(rows, columns + 1):
        x0 = left + (column - 0.5 * (row % 2)) * dx
        x1, y = min(x0 + 0.92 * dx, right), top + row * dy
        corners = [(max(x0, left), y), (x1, y), (x1, y + 0.86 * dy), (max(x0, left), y + 0.86 * dy)]
        if x1 > max(x0, left):
            wall.shape(corners, tones[rng.integers(len(tones))])
