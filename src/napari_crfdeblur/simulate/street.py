"""A colorful street in linear light: windows, posters, lettering, bricks and leaves."""

from math import tau

import numpy as np
from scipy import ndimage

from .. import arguments
from .._typing import FloatArray
from .houses import SHOPS, corner_building, house
from .perspective import Surface, light_of
from .scenes import Scene, checked_shape
from .truth import clean_edges

WALLS = ("#e9b44c", "#d9654b", "#5b9aa0", "#f0dcc0", "#8fb27a", "#c98bb0")
LEAVES = ("#1f4a2b", "#2f5d34", "#3f7a3d", "#5c9a45", "#93c055")
WHOLE = ((0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0))  # the picture itself as a surface


def street(shape: tuple[int, int], *, seed: int = 0) -> Scene:
    """A street corner by daylight, in perspective.

    Long straight edges of many directions lie between areas of different colors, with
    lettering, window bars, brickwork and foliage beside them.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns; a picture of 3 to 2 looks best.
    seed : int
        Colors of the houses, posters and details; the same seed gives the same scene.
    """
    # One stream for each part: what the road draws depends on the size of the picture.
    shape = checked_shape(shape)
    arguments.whole(seed, "a seed", least=0)
    clouds, grain, details, leaves = np.random.default_rng(seed).spawn(4)
    canvas = np.empty((*shape, 3), dtype=np.float32)
    _sky(canvas, clouds)
    picture = Surface(canvas, WHOLE)
    _road(picture, grain)
    near, far = ((0.03, 0.60), (0.90, 0.60)), ((0.30, -0.04), (0.75, -0.04))
    left = Surface(canvas, (far[0], near[0], near[1], far[1]), 1.0, picture.lines)
    _row_of_houses(left, details)
    far = (0.19, 1.03), (0.815, 1.03)
    right = Surface(canvas, (near[0], far[0], far[1], near[1]), 0.6, picture.lines)
    corner_building(right, details)
    _tree(picture, leaves)
    reach = max(4.0, 0.02 * min(shape))
    return Scene(np.clip(canvas, 0, 1), tuple(clean_edges(canvas, picture.lines, reach)))


def _sky(canvas: FloatArray, rng: np.random.Generator) -> None:
    """Blue that pales towards the horizon, and a few clouds."""
    height = np.linspace(0, 1.4, canvas.shape[0])[:, np.newaxis, np.newaxis].clip(0, 1)
    canvas[:] = (1 - height) * light_of("#5aa2dc") + height * light_of("#e6f1f5")
    sky = Surface(canvas, WHOLE)
    for x, y in ((0.10, 0.10), (0.36, 0.05), (0.86, 0.06)):
        for _ in range(40):
            center = x + 0.05 * rng.standard_normal(), y + 0.010 * rng.standard_normal()
            radius = rng.uniform(0.01, 0.03)
            sky.shape(_ellipse(center, radius, 0.6 * radius), "#ffffff", opacity=0.25)


def _road(picture: Surface, rng: np.random.Generator) -> None:
    """Asphalt with a zebra crossing, and a pavement along the houses."""
    picture.shape([(0, 0.6), (1, 0.6), (1, 1), (0, 1)], "#6d7076")
    rows = picture.canvas.shape[0]
    asphalt = picture.canvas[int(0.7 * rows) :]
    grain = ndimage.gaussian_filter(rng.standard_normal(asphalt.shape[:2]), rows / 500)
    asphalt *= (1 + 0.10 * grain / grain.std())[..., np.newaxis].clip(0.6, 1.4)
    corners = ((0.83, 0.00), (0.93, 0.40), (1.10, 0.26), (0.94, -0.25))
    crossing = Surface(picture.canvas, corners, 1.0, picture.lines)
    for stripe in range(5):
        crossing.panel((stripe / 5, 0, stripe / 5 + 0.11, 1), "#eeece4")
    near, corner, far = [(-0.01, 0.74), (-0.01, 0.80)], [(0.60, 0.90), (0.60, 0.965)], 0.86
    picture.facet([near[0], corner[0], (1.01, 0.80), (1.01, far), corner[1], near[1]], "#b9b2a4")
    kerb = [near[1], corner[1], (1.01, far), (1.01, far + 0.012), (0.6, 0.98), (-0.01, 0.81)]
    picture.shape(kerb, "#8d877b")


def _row_of_houses(wall: Surface, rng: np.random.Generator) -> None:
    """Four houses of different color and height, the last one at the corner."""
    colors = [WALLS[i] for i in rng.permutation(len(WALLS))[:4]]
    joints = (0.0, 0.25, 0.5, 0.75, 1.0)
    for number, (color, top) in enumerate(zip(colors, (0.10, -0.08, 0.07, 0.0), strict=True)):
        part = wall.part((joints[number], top, joints[number + 1], 1))
        house(part, color, SHOPS[number], rng)


def _tree(picture: Surface, rng: np.random.Generator) -> None:
    """A tree whose leaves catch the light from above."""
    trunk = [(0.075, 0.5), (0.095, 0.5), (0.105, 0.84), (0.065, 0.84)]
    picture.shape(trunk, "#4d3a2c")
    branches = [(0.03, 0.44), (0.12, 0.38), (0.08, 0.30), (0.16, 0.50), (0.02, 0.55)]
    wide = picture.canvas.shape[0] / picture.canvas.shape[1]
    for _ in range(1300):
        x, y = branches[rng.integers(len(branches))]
        away = rng.normal(0, 0.045, size=2)
        leaf = _ellipse((x + away[0] * wide, y + away[1]), 0.008 * wide, 0.0055)
        tone = 2 - 25 * away[1] + rng.normal(0, 1)
        picture.shape(leaf, LEAVES[int(np.clip(tone, 0, len(LEAVES) - 1))])


def _ellipse(center: tuple[float, float], width: float, height: float) -> FloatArray:
    angles = np.linspace(0, tau, 24, endpoint=False)
    return np.column_stack(
        [center[0] + width * np.cos(angles), center[1] + height * np.sin(angles)]
    )
