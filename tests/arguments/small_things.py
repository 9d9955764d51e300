"""Small, asymmetric pictures and what belongs to them, from which calls are made."""

from dataclasses import fields

import numpy as np

from napari_crfdeblur import response
from napari_crfdeblur.deconvolution import Wiener
from napari_crfdeblur.edges import Edge
from napari_crfdeblur.estimate import GivenResponse, ResponseStatus
from napari_crfdeblur.pipeline import DeblurOptions
from napari_crfdeblur.psf import GivenPsf, PsfField, PsfStatus
from napari_crfdeblur.response import Gamma
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles

SHAPE = (24, 33)
RNG = np.random.default_rng(20)
ROWS, COLUMNS = np.mgrid[:24, :33]
STEP = np.clip((COLUMNS - 15.3 - 0.1 * ROWS) / 4 + 0.5, 0, 1)
PLANE = (0.15 + 0.6 * STEP + 0.01 * RNG.standard_normal(SHAPE)).astype(np.float32)
COLOR = np.stack([PLANE, 0.9 * PLANE + 0.02, 1 - PLANE], axis=-1)
PHOTO = np.rint(255 * PLANE).astype(np.uint8)
KERNEL = np.array([[0.0, 1, 2, 4, 0], [1, 3, 0, 1, 0], [0, 2, 1, 0, 0]])
SHAKEN = np.pad(KERNEL, [(1, 1), (0, 0)]) / KERNEL.sum()
CAMERA = Camera(Gamma(1.8), noise=0.002)
CASE = ProfileCase(groups=2, profiles=4, samples=15)
GROUPS = tuple(random_profiles(CAMERA, CASE, seed=3))
EDGE = Edge((2.0, 15.5), (21.0, 17.4), polarity=1, width=5.0, contrast=0.6)
PRIOR = response.around(Gamma(2.0))
FIELD = PsfField(np.stack([[SHAKEN, SHAKEN]]), ((PsfStatus.GOOD,) * 2,), SHAPE)
BAND = np.linspace(0, 1, 9)
ESTIMATE = {
    "curve": Gamma(2.0),
    "intensity": BAND,
    "lower": BAND**2,
    "upper": BAND**1.8,
    "covered": (0.1, 0.9),
    "status": ResponseStatus.GOOD,
    "diagnostics": {"profiles": 3.0},
    "findings": (),
    "posterior": PRIOR,
}
ROW = GROUPS[0]
GROUP = {field.name: getattr(ROW, field.name) for field in fields(ROW)}
QUICK = DeblurOptions(GivenResponse(Gamma(2.0)), psf=GivenPsf(KERNEL), method=Wiener())
