"""The pixels of image layers: photos as jobs take them, and PSFs."""

from typing import Any

import numpy as np
from napari.layers import Image as ImageLayer
from napari.layers import Layer

from .._typing import FloatArray
from ..arguments import refusal
from ..errors import CrfDeblurError
from ..pipeline import PhotoStack

KEY = "napari-crfdeblur"  # in the metadata of every layer that was made here
KINDS = (np.uint8, np.uint16, np.float16, np.float32, np.float64)


def source_of(layer: ImageLayer, white: float | None = None) -> PhotoStack:
    """What a job needs of a photo layer; refuses what is no photo in a sentence.

    Raises
    ------
    CrfDeblurError
        No layer, not an image, fewer than two axes, empty, or numbers of another kind.
    ValueError
        No layer but something else, or a white level that is not above 0.
    """
    layer = unwrapped(layer)
    if layer is None:
        raise CrfDeblurError("there is no photo yet: open one, or choose an image layer")
    if not isinstance(layer, Layer):
        raise refusal("an image layer", layer)
    if not isinstance(layer, ImageLayer):
        raise CrfDeblurError(
            f"“{layer.name}” is a {type(layer).__name__} layer: choose an image layer instead"
        )
    data = layer.data[0] if layer.multiscale else layer.data
    shape = tuple(data.shape[: data.ndim - layer.rgb])
    if len(shape) < 2 or 0 in data.shape:
        raise CrfDeblurError(
            f"“{layer.name}” has shape {tuple(data.shape)}: choose a picture with rows and columns"
        )
    if white is not None and not (np.isfinite(white) and white > 0):
        raise refusal("a positive white level", white)
    if white is None and data.dtype not in KINDS:
        raise CrfDeblurError(
            f"“{layer.name}” holds numbers of kind {data.dtype}: set the white level, the value "
            "of the brightest pixel that the camera can record"
        )
    return PhotoStack(data, bool(layer.rgb), white, layer.name)


def unwrapped(thing: Any) -> Any:
    """The viewer or layer itself, where napari hands a plugin a proxy of it."""
    return getattr(thing, "__wrapped__", thing)


def kernel_of(layer: ImageLayer, photo: ImageLayer | None = None) -> FloatArray:
    """The PSF in an image layer, shape (H, W), or (D, H, W) for a photo that is a stack.

    Raises
    ------
    CrfDeblurError
        In color, or more axes than a PSF of this photo can have.
    """
    source = source_of(layer, white=1.0)
    if source.rgb:
        raise CrfDeblurError(f"“{layer.name}” has colors: a PSF is a grayscale picture")
    axes = 3 if photo is not None and photo.ndim > 2 else 2
    *others, depth = (1, *source.shape[:-2])
    if max((*others, 1)) > 1 or (axes == 2 and depth > 1):
        wanted = "a single picture" if axes == 2 else "a picture, or one stack of them"
        raise CrfDeblurError(f"“{layer.name}” is a stack: a PSF is {wanted}")
    shape = source.shape[-2:] if depth == 1 else (depth, *source.shape[-2:])
    return np.asarray(source.data, dtype=np.float64).reshape(shape)


def file_of(layer: Layer) -> str | None:
    """Where a layer was read from, if it was."""
    path = layer.source.path
    return None if path is None else str(path)
