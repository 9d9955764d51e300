"""Small inputs for runs of the command that take a moment, and what a run may leave behind."""

import json
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from napari_crfdeblur.io import write_photo, write_psf
from napari_crfdeblur.io.places import PREFIX
from napari_crfdeblur.psf import camera_shake

KNOWN = ["--response", "srgb", "--psf", "psf.png", "--method", "wiener"]
RESPONSE = {
    "format": "crfdeblur-response",
    "version": 1,
    "direction": "inverse",
    "channels": [{"intensity": [0, 0.5, 1], "irradiance": [0, 0.2, 1]}],
}
EDGES = {
    "format": "crfdeblur-edges",
    "version": 1,
    "edges": [{"start": [5, 5], "end": [40, 30]}],
}


def make_inputs(folder):
    """A photo of 48 rows and 64 columns, a PSF, a response and edges."""
    noise = np.random.default_rng(3).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    write_photo(folder / "photo.png", gaussian_filter(noise, (1, 1, 0)))
    write_psf(folder / "psf.png", camera_shake(5, 3))
    (folder / "curve.json").write_text(json.dumps(RESPONSE))
    (folder / "edges.json").write_text(json.dumps(EDGES))


def everything(folder=Path()):
    """Contents of all files, by name; what was being written counts."""
    return {str(p): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def unfinished(folder=Path()):
    """What runs that were not ended properly have left."""
    return [*folder.rglob(f"{PREFIX}*"), *folder.rglob(".tmp*")]


def one_sentence(error):
    """Whether this is one line that only a refusal writes, and that can do no harm."""
    line = error.removesuffix("\n")
    return line.startswith("crfdeblur: ") and line.isprintable() and error.endswith("\n")
