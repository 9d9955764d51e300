"""Where the camera saturated, so that what it recorded is only a lower bound of the light."""

import numpy as np
from scipy import ndimage

from .. import arguments
from .._typing import BoolArray, Image
from ..photo import check_image, full_scale

# Share of the full scale below which compression and conversion between color spaces scatter
# pixels that were saturated: 3 of 255 levels for JPEG of usual quality.
SCATTER = 3 / 255
# Of the pixels at the top, to within the scatter, so many are at the very top if nothing came after
# the camera clipped: .87 to .99 in 17 of 18 simulated photos; a resize by 1/2 and JPEG 90 leave .40
# to .81 of them.
SHARP = 0.85


def clipped_pixels(photo: Image, *, level: float = 1.0, scatter: float = SCATTER) -> BoolArray:
    """Pixels in which the camera saturated, so that they recorded only a lower bound.

    They are at the top of the recorded range, or so little below it that compression can have
    put them there. That some pixel is taken for saturated that is merely bright does no harm:
    deconvolution then knows that its light is not less, which is true.

    Parameters
    ----------
    photo : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        uint8, uint16, or float in [0, 1], as recorded: before the response is undone. Leave
        out alpha.
    level : float
        Top of the recorded range as a share of the full scale; below 1 for a camera, or a
        converter of raw files, that saturates earlier.
    scatter : float
        Share of the full scale by which a saturated pixel can lie below `level`. 0 for photos
        that were never compressed.

    Returns
    -------
    ndarray of bool, the shape of `photo`
        Channel by channel: a red light saturates red alone.
    """
    check_image(photo)
    arguments.number(level, "a level", above=0, most=1)
    arguments.number(scatter, "a scatter", least=0, below=level)
    # a hundredth of an 8-bit level for what is rounded in floats
    least = (level - scatter - 1e-2 / 255) * full_scale(photo)
    clipped: BoolArray = photo >= photo.dtype.type(
        np.ceil(least) if photo.dtype.kind == "u" else least
    )
    return clipped


def clipped_light(photo: Image, *, axes: int = 2) -> BoolArray:
    """Pixels in which the camera saturated, and those that have taken in light of such pixels.

    A photo that is resized or compressed after it was taken has mixtures around what saturated,
    which are lower bounds as well. It shows by the shape of the lights: no tops that are flat to
    their rims any more, but scattered ones. Then the pixels beside those of
    :func:`clipped_pixels` count, too, channel by channel.

    Parameters
    ----------
    photo : ndarray, shape (M, N) or (M, N, C); (Z, M, N) or (Z, M, N, C) for 3 axes
        uint8, uint16, or float in [0, 1], as recorded; without alpha.
    axes : int
        2 for a photo, 3 for a volume.

    Returns
    -------
    ndarray of bool, the shape of `photo`
    """
    arguments.whole(axes, "a number of axes", least=2, most=3)
    photo = arguments.array(photo, "a photo or volume", axes=(axes, axes + 1))
    rows = photo.reshape(-1, *photo.shape[axes - 1 :])
    clipped = clipped_pixels(rows)
    top = clipped_pixels(rows, scatter=0.0)
    for channel in np.ndindex(rows.shape[2:]):
        own = (..., *channel)
        if np.count_nonzero(top[own]) < SHARP * np.count_nonzero(clipped[own]):
            plane = clipped[own].reshape(photo.shape[:axes])
            beside = ndimage.generate_binary_structure(2, 1).reshape((1,) * (axes - 2) + (3, 3))
            clipped[own] = ndimage.binary_dilation(plane, beside).reshape(clipped[own].shape)
    return clipped.reshape(photo.shape)
