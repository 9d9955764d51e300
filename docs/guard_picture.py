"""Draw what the guard and the map of trust do: docs/images/guard.png.

    python docs/guard_picture.py [FILE]

A drawn street, photographed with a blurred lens: restored with its own PSF and with one that is
turned, without and with the guard; and what can be believed, white all.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from napari_crfdeblur.estimate import GivenResponse
from napari_crfdeblur.pipeline import DeblurOptions, deblur
from napari_crfdeblur.psf import GivenPsf, camera_shake
from napari_crfdeblur.response import SRGB
from napari_crfdeblur.simulate import Camera, simulate, street

SHAPE, GAP = (300, 330), 6
COLORS = 255  # of the picture: enough for the eye, at a third of the size
PSF = camera_shake(15, seed=4)


def main() -> None:
    """Draw it."""
    folder = Path(__file__).resolve().parent / "images"
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else folder / "guard.png"
    photo = simulate(street(SHAPE, seed=3), PSF, Camera(SRGB(), noise=0.003), seed=2).photo
    rows = []
    for psf in (PSF, np.rot90(PSF)):
        shown = [photo]
        for guard in (False, True):
            options = DeblurOptions(GivenResponse(SRGB()), psf=GivenPsf(psf), guard=guard)
            found = deblur(photo, options)
            shown.append(found.photo)
        believed = np.rint(255 * found.trust.believed).astype(np.uint8)
        shown.append(np.repeat(believed[..., None], 3, axis=-1))
        colors = [each if each.ndim == 3 else np.stack([each] * 3, axis=-1) for each in shown]
        padded = [
            np.pad(each, ((0, GAP), (0, GAP), (0, 0)), constant_values=255) for each in colors
        ]
        rows.append(np.concatenate(padded, axis=1))
    sheet = Image.fromarray(np.concatenate(rows)[:-GAP, :-GAP])
    sheet.quantize(COLORS).save(path, optimize=True)


if __name__ == "__main__":
    main()
