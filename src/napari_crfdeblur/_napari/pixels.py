"""The pixels of image layers: photos as jobs take them, and PSFs."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from napari.layers import Image as ImageLayer
from napari.layers import Layer

from .._typing import FloatArray, Image
from ..errors import CrfDeblurError
from ..photo import from_unit

Region: TypeAlias = tuple[slice, ...]
"""Part of a layer's data: one slice with start and stop for each axis, color left out."""

KINDS = (np.uint8, np.uint16, np.float16, np.float32, np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """The pixels of a photo layer as they were when a job began; safe in any thread.

    Parameters
    ----------
    data : array_like, shape (..., M, N) or (..., M, N, C)
        Of a numpy array, a dask array or the finest level of a pyramid.
    rgb : bool
        Whether the last axis holds colors.
    white : float or None
        Value that stands for intensity 1; by default the full scale of the kind of number.
    name : str
        Of the layer, for messages.
    """

    data: Any
    rgb: bool
    white: float | None
    name: str

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape without the color axis."""
        return tuple(self.data.shape[: self.data.ndim - self.rgb])

    @property
    def dtype(self) -> np.dtype[Any]:
        """Kind of number of the layer, and of what is given back."""
        dtype: np.dtype[Any] = np.dtype(self.data.dtype)
        return dtype

    @property
    def whole(self) -> Region:
        """All of it."""
        return tuple(slice(0, side) for side in self.shape)

    def photo(self, region: Region) -> Image:
        """One plane, or a part of it, as a photo: (M, N), (M, N, 3) or (M, N, 4)."""
        pixels = np.asarray(self.data[region])
        if pixels.dtype != self.dtype:
            raise CrfDeblurError(
                f"“{self.name}” says that it holds {self.dtype}, but this slice is "
                f"{pixels.dtype}; convert all slices to one kind of number"
            )
        pixels = pixels.reshape(pixels.shape[len(self.shape) - 2 :])
        return self.in_unit(pixels)

    def in_unit(self, pixels: Image) -> Image:
        """Pixels of the layer with its white level at 1; without one, as they are."""
        if self.white is None:
            return pixels
        return np.clip(pixels / np.float32(self.white), 0, 1).astype(np.float32, copy=False)

    def recorded(self, photo: Image) -> Image:
        """A photo in the layer's own numbers: the way back of :meth:`photo`."""
        if self.white is None:
            return photo.astype(self.dtype, copy=False)
        values = from_unit(photo, np.float32) * np.float32(self.white)
        if self.dtype.kind in "iu":
            values = np.rint(values)
        return values.astype(self.dtype)


def source_of(layer: ImageLayer, white: float | None = None) -> Source:
    """What a job needs of a photo layer; refuses what is no photo in a sentence.

    Raises
    ------
    CrfDeblurError
        No layer, not an image, fewer than two axes, empty, or numbers of another kind.
    """
    layer = unwrapped(layer)
    if layer is None:
        raise CrfDeblurError("there is no photo yet: open one, or choose an image layer")
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
        raise ValueError(f"expected a positive white level, got {white}")
    if white is None and data.dtype not in KINDS:
        raise CrfDeblurError(
            f"“{layer.name}” holds numbers of kind {data.dtype}: set the white level, the value "
            "of the brightest pixel that the camera can record"
        )
    return Source(data, bool(layer.rgb), white, layer.name)


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
