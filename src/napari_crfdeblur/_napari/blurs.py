"""The blur as it is shown: a PSF, or the map of those of all parts."""

from typing import TYPE_CHECKING

import numpy as np

from .._typing import FloatArray
from ..pipeline.blur import Blur
from ..pipeline.intermediates import PLANE
from ..psf import PsfField
from ..report import draw_psf
from ..report.pictures import draw_psf_field

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def seen(psf: FloatArray) -> FloatArray:
    """A PSF as a picture, shape (H, W): that of volumes as it is seen along the first axis."""
    return psf if psf.ndim == PLANE else np.asarray(psf.sum(axis=0))


def draw_blur(ax: "Axes", blur: Blur) -> None:
    """Draw a PSF, or the map of those of all parts."""
    if isinstance(blur, PsfField):
        draw_psf_field(ax, blur)
    else:
        draw_psf(ax, seen(blur))
