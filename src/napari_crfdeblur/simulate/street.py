"""A colourful street in linear light: windows, posters, lettering, bricks and leaves."""

from math import tau

import numpy as np

from .._typing import FloatArray
from .houses import bricks, corner_building, house, windows
from .perspective import Surface, light_of
from .raster import paint
from .scenes import Scene
from .truth import clean_edges

WALLS = ("#e9b44c", "#d9654b", "#5b9aa0", "#f0dcc0", "#8fb27a", "#c98bb0")
LEAVES = ("#2f5d34", "#3f7a3d", "#5c9a45", "#86b94f", "#274d38")


def street(shape: tuple[int, int], *, seed: int = 0) -> Scene:
    """A street corner by daylight, in perspective.

    Long straight edges of many directions lie between areas of different colours, with
    lettering, window bars, brickwork and foliage beside them.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns; a picture of 3 to 2 looks best.
    seed : int
        Colours of the houses, posters and details; the same seed gives the same scene.
    """
    rng = np.random.default_rng(seed)
    canvas = np.empty((*shape, 3), dtype=np.float32)
    _sky(canvas, rng)
    ground = Surface(canvas, [(0.60, 0.0), (0.60, 1.0), (1.0, 1.0), (1.0, 0.0)])
    _road(ground)
    left = Surface(
        canvas, [(0.30, -0.04), (0.03, 0.60), (0.90, 0.60), (0.75, -0.04)], 1.0, ground.lines
    )
    _row_of_houses(left, rng)
    right = Surface(
        canvas, [(0.03, 0.60), (0.19, 1.03), (0.815, 1.03), (0.90, 0.60)], 0.62, ground.lines
    )
    corner_building(right, rng)
    _tree(canvas, (0.50, 0.10), rng)
    reach = max(4.0, 0.02 * min(shape))
    return Scene(np.clip(canvas, 0, 1), tuple(clean_edges(canvas, ground.lines, reach)))
