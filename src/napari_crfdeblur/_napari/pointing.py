"""Streaks, beads and paths that the user draws on a photo, as methods to find its PSF."""

import numpy as np
from napari.layers import Image as ImageLayer
from napari.layers import Points, Shapes

from ..errors import CrfDeblurError
from ..psf import Beads, MotionPath, PsfAt, PsfEstimator
from ..psf.points import SMALLEST_BOX
from .shapes import points_in, region_drawn_on

NOTHING = "nothing is drawn yet: put a point on each bead, or drag a rectangle around a streak"


def method_drawn_on(layer: Points | Shapes, photo: ImageLayer, size: int) -> PsfEstimator:
    """What a layer points to.

    The points of a Points layer are beads. Of a Shapes layer the last shape counts: a path or a
    line is the motion of the camera, and any other shape is a box around a streak.

    Parameters
    ----------
    layer : Points or Shapes
    photo : napari.layers.Image
    size : int
        Side in pixels of the box around each point, odd.

    Raises
    ------
    CrfDeblurError
        Nothing is drawn, or not on the photo.
    """
    if not len(layer.data):
        raise CrfDeblurError(NOTHING)
    if isinstance(layer, Points):
        places = points_in(layer, np.asarray(layer.data), photo)
        if np.min(places) < 0:
            raise CrfDeblurError("a point lies outside the photo: put it on a bead")
        return Beads(tuple(places), size)
    if layer.shape_type[-1] in ("path", "line"):
        return MotionPath(tuple(points_in(layer, np.asarray(layer.data[-1]), photo)))
    *_, rows, columns = region_drawn_on(layer, photo)
    side = max(rows.stop - rows.start, columns.stop - columns.start, SMALLEST_BOX) | 1
    middle = [(span.start + span.stop - 1) / 2 for span in (rows, columns)]
    return PsfAt(middle[0], middle[1], side)
