"""Sample photos whose response, blur and noise are known, made on demand."""

from math import inf, pi, tau
from typing import TYPE_CHECKING, Any

import numpy as np

from .._typing import FloatArray
from ..demo import RESPONSE
from ..photo import from_unit
from ..psf import camera_shake, disk, gaussian, kernel_b
from ..response import Polynomial
from ..simulate import Camera, Scene, Simulated, simulate, slanted_edges, step_image, street
from ..simulate.raster import paint

if TYPE_CHECKING:
    from napari.types import LayerDataTuple

SECTIONS = 4
CELL = 150.0  # pixels of a section that each thing on the slide has for itself
MARGIN = 8  # pixels around a section that the blur takes away
BACKGROUND = 0.06

# The cameras do not round, `_layer` does: the exact rounding of simulate() takes seconds for a
# curve without a formula in the forward direction.
PHONE = Camera(RESPONSE, noise=0.003, bits=None)
MICROSCOPE = Camera(Polynomial((0.3, 0.1, 0.6)), photons=20_000, bits=None)


def steps() -> "list[LayerDataTuple]":
    """Gray bars, moved during the exposure: the step image of Kim et al. 2012, Fig. 1."""
    return [_layer("Step image (paper)", simulate(step_image((300, 480)), kernel_b(), PHONE), 8)]


def slanted() -> "list[LayerDataTuple]":
    """Colored squares out of focus, 16 bits: edges of many directions and ranges."""
    scene = slanted_edges((600, 800), seed=1, channels=3)
    return [_layer("Slanted edges", simulate(scene, disk(5.5), PHONE, seed=1), 16)]


def photo() -> "list[LayerDataTuple]":
    """A street by daylight, blurred by the shake of the camera."""
    made = simulate(street((614, 914)), camera_shake(15, 0), PHONE)
    return [_layer("Blurred photo (street)", made, 8)]


def slide() -> "list[LayerDataTuple]":
    """Four sections of a specimen under a microscope, 16 bits, pixels of 0.2 µm, 1 µm apart."""
    psf = gaussian(2.0)
    sections = [simulate(section(seed), psf, MICROSCOPE, seed=seed) for seed in range(SECTIONS)]
    layers = [_layer("Microscope slide", made, 16) for made in sections]
    data, options = np.stack([layer[0] for layer in layers]), layers[0][1]
    options["metadata"]["truth"]["seed"] = [made.seed for made in sections]
    place = {
        "scale": (1.0, 0.2, 0.2),
        "units": ("um", "um", "um"),
        "axis_labels": ("z", "y", "x"),
    }
    return [(data, options | place, "image")]


def section(seed: int) -> Scene:
    """Bright bars and spots of different brightness on a dark slide, 3 rows of 4."""
    rng = np.random.default_rng(seed)
    shape = int(3 * CELL) + 2 * MARGIN, int(4 * CELL) + 2 * MARGIN
    linear = np.full(shape, BACKGROUND, dtype=np.float32)
    for cell in np.ndindex(3, 4):
        middle = MARGIN + CELL * (np.array(cell) + 0.5) + rng.uniform(-6, 6, size=2)
        outline = _bar(rng) if rng.random() < 0.75 else _spot(rng)
        paint(linear, [middle + outline], rng.uniform(0.3, 0.97))
    return Scene(linear)


def _bar(rng: np.random.Generator) -> FloatArray:
    """Corners, shape (4, 2), of a bar about the origin at any angle."""
    angle = rng.uniform(0, pi)
    along = np.array([np.sin(angle), np.cos(angle)]) * rng.uniform(48, 62)
    across = np.array([np.cos(angle), -np.sin(angle)]) * rng.uniform(18, 30)
    return np.array([along + across, along - across, -along - across, -along + across])


def _spot(rng: np.random.Generator) -> FloatArray:
    """Outline, shape (64, 2), of a disk about the origin."""
    angles = np.linspace(0, tau, 64, endpoint=False)
    circle = np.column_stack([np.sin(angles), np.cos(angles)])
    return np.asarray(rng.uniform(12, 24) * circle)


def _layer(name: str, made: Simulated, bits: int) -> "LayerDataTuple":
    """A simulated photo as an image layer that is shown over its full scale."""
    options = {
        "name": name,
        "rgb": made.photo.ndim == 3,
        "contrast_limits": (0.0, 2.0**bits - 1),
        "metadata": {"truth": _truth(made, bits)},
    }
    return from_unit(made.photo, f"uint{bits}"), options, "image"


def _truth(made: Simulated, bits: int) -> dict[str, Any]:
    """What made a photo, in numbers, words and lists that JSON can hold."""
    camera = made.camera
    curve: Any = camera.response  # of either camera, with coefficients
    return {
        "response": {"curve": type(curve).__name__, "coefficients": list(curve.coefficients)},
        "psf": made.psf.tolist(),
        "noise": camera.noise,
        "photons": None if camera.photons == inf else camera.photons,
        "bits": bits,
        "seed": made.seed,
    }
