"""How far a blind PSF can be trusted: whether parts of the picture agree on it."""

import numpy as np

from ..._typing import FloatArray
from ..misfit import misfit
from ..status import PsfStatus
from .blurred import Blurred
from .edge_prediction import EdgePredictor
from .gradient_noise import noise_of_gradients
from .kernel_fit import KernelFit

WEAKEST = 9e-4  # weight of a step's existence: steps of 3 % of the contrast are predicted
SMOOTHNESS = 3.5  # of the PSFs that parts of the picture give, for contrast 1

# What good estimates reach. The limits of agreement were chosen on 28 pictures blurred by known
# PSFs, of which 5 were deblurred more than 2.5 times as wrong as with the true PSF: 4 of those
# fall short of one of these, and so do 3 others. Of 51 PSFs of Variational, 35 on pictures that
# were not looked at, 8 were that wrong, 4 of which fall short, and so do 4 others: agreement is
# necessary for a good PSF, not sufficient. The share of the contrast that stays unexplained was
# chosen on 62: it told 2 more of the wrong PSFs, and one good one, of a JPEG photo.
LEAST_BETWEEN_HALVES = 0.94
LEAST_BETWEEN_DIRECTIONS = 0.975
LEAST_EXTENT = 1 / 3
MOST_UNEXPLAINED = 0.01
# The same for a PSF that several searches agree on, where parts need not agree so well. Chosen on
# 35 photos: 19 were called good, all rightly, which are 68 % of the right ones. On 26 others 15
# were called good, 13 rightly, again 68 %.
LEAST_AGREEMENT = 0.85
LEAST_OF_SEVERAL = {"halves": 0.9, "directions": 0.95, "extent": 0.28}
FAINT = 0.05  # of the peak: does not count as extent


def diagnose(blurred: Blurred, psf: FloatArray) -> dict[str, float]:
    """Figures that tell a PSF which the picture determines from one that noise does.

    Parameters
    ----------
    blurred : Blurred
        What the PSF was found in.
    psf : ndarray, shape (S, S)
        The PSF found, by whatever method.

    Returns
    -------
    dict of str to float
        ``residual``: share of the blurred gradient's energy that the PSF leaves unexplained.
        ``halves``, ``directions``: the cosine between the PSFs that the left and the right
        half of the picture give, and its horizontal and its vertical edges.
        ``compactness``: share of the PSF's mass in as many pixels as a thin line of its size
        covers, two for each pixel of length.
        ``extent``: longest side of the PSF as a share of its array. A PSF much smaller than
        asked for is often none: that nothing was blurred always fits somehow.
        ``unexplained``: what the picture shows at the frequencies that the PSF blocks
        (:func:`~napari_crfdeblur.psf.misfit.misfit`), as a share of four standard deviations of
        the picture, without the white noise.
    """
    size, measured = len(psf), blurred.gradient()
    edges = blurred.kept(EdgePredictor.of(blurred.plane, size).predict(psf, WEAKEST))
    middle = edges.shape[2] // 2
    left, right = slice(None, middle), slice(middle, None)
    halves = [
        KernelFit.of(edges[..., half], measured[..., half], size).solve(SMOOTHNESS)
        for half in (left, right)
    ]
    directions = [
        KernelFit.of(edges[[axis]], measured[[axis]], size).solve(SMOOTHNESS) for axis in (0, 1)
    ]
    return {
        "residual": KernelFit.of(edges, measured, size).residual(psf),
        "halves": _cosine(*halves),
        "directions": _cosine(*directions),
        "compactness": float(np.sort(psf, axis=None)[-2 * size :].sum()),
        "extent": float(
            max(np.ptp(axis) + 1 for axis in np.nonzero(psf > FAINT * psf.max())) / size
        ),
        "unexplained": _unexplained(blurred, psf),
    }


def judge_agreement(figures: dict[str, float]) -> PsfStatus:
    """Status that the agreement between the parts of the picture permits."""
    good = (
        figures["halves"] >= LEAST_BETWEEN_HALVES
        and figures["directions"] >= LEAST_BETWEEN_DIRECTIONS
        and figures["extent"] >= LEAST_EXTENT
        and figures["unexplained"] <= MOST_UNEXPLAINED
    )
    return PsfStatus.GOOD if good else PsfStatus.DOUBTFUL


def judge_several(figures: dict[str, float]) -> PsfStatus:
    """Status that the agreement of several searches, and of the parts of the picture, permits."""
    good = figures["agreement"] >= LEAST_AGREEMENT and all(
        figures[name] >= least for name, least in LEAST_OF_SEVERAL.items()
    )
    return PsfStatus.GOOD if good else PsfStatus.DOUBTFUL


def _unexplained(blurred: Blurred, psf: FloatArray) -> float:
    lost = None if blurred.usable is None else [blurred.usable == 0]
    found = misfit([blurred.plane], psf, lost, least_blocked=0.0) or 0.0
    noise = noise_of_gradients(blurred) / np.sqrt(2)
    return float(np.sqrt(max(found**2 - noise**2, 0.0)) / (4 * blurred.plane.std()))


def _cosine(first: FloatArray, second: FloatArray) -> float:
    """Cosine between the positive parts of two PSFs; 0 if one has none."""
    first, second = np.maximum(first, 0), np.maximum(second, 0)
    norms = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(np.vdot(first, second)) / norms if norms > 0 else 0.0
