"""Layers of results, placed and shown like the photo that they come from."""

from typing import Any

import numpy as np
from napari.layers import Image as ImageLayer
from napari.utils.transforms import Affine

from .._typing import FloatArray, Image
from ..deconvolution.tiles import Region

SPATIAL = ("scale", "translate", "rotate", "shear", "affine", "units", "axis_labels")


def place_content(layer: ImageLayer) -> dict[str, Any]:
    """Scale, place, units and names of the axes of a layer, JSON-safe."""
    return {
        "scale": [float(step) for step in layer.scale],
        "translate": [float(start) for start in layer.translate],
        "units": [str(unit) for unit in layer.units],
        "axis_labels": [str(label) for label in layer.axis_labels],
    }


def placed(layer: ImageLayer, region: Region | None = None) -> dict[str, Any]:
    """The seven spatial properties of a layer, for its data or a region of it."""
    place = {name: getattr(layer, name) for name in SPATIAL}
    if region is not None:
        start = np.array([axis.start for axis in region], dtype=float)
        linear = Affine(scale=layer.scale, rotate=layer.rotate, shear=layer.shear).linear_matrix
        place["translate"] = layer.translate + linear @ start
    return place


def layer_like(
    layer: ImageLayer, name: str, data: Image, region: Region, **options: Any
) -> ImageLayer:
    """A layer of pixels computed from a region of another one, placed and colored like it."""
    options = {
        "contrast_limits": layer.contrast_limits,
        "gamma": layer.gamma,
        "interpolation2d": layer.interpolation2d,
        **({} if layer.rgb else {"colormap": layer.colormap.name}),
        **placed(layer, region),
        **options,
    }
    return ImageLayer(data, name=name, rgb=layer.rgb, multiscale=False, **options)


def beside(layer: ImageLayer, name: str, kernel: FloatArray, metadata: Any) -> ImageLayer:
    """A PSF as a layer to the left of the photo, in pixels of the same size.

    Beside a stack it is a single picture, too: with the slices' axis it would be seen on one.
    One of three dimensions begins at the first slice.
    """
    shift = slice(-(kernel.shape[-1] + 4), -4)
    place = placed(layer, (*(slice(0, 1) for _ in range(layer.ndim - 1)), shift))
    data = kernel.astype(np.float32)
    return ImageLayer(
        data,
        name=name,
        rgb=False,
        colormap="inferno",
        contrast_limits=(0.0, float(data.max())),
        metadata=metadata,
        **_of_last(place, kernel.ndim),
    )


def _of_last(place: dict[str, Any], axes: int) -> dict[str, Any]:
    """Spatial properties for the last axes alone; the same where there is nothing else."""
    if len(place["scale"]) == axes:
        return place
    last = np.s_[-axes:, -axes:]
    return {
        **{name: place[name][-axes:] for name in ("scale", "translate", "units", "axis_labels")},
        "rotate": place["rotate"][last],
        "shear": place["shear"][-(axes * (axes - 1) // 2) :],  # upper triangle, row by row
        "affine": Affine(
            linear_matrix=place["affine"].linear_matrix[last],
            translate=place["affine"].translate[-axes:],
        ),
    }
