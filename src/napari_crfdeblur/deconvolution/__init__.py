"""Deconvolution: from a linear image and its PSF to a sharper linear image."""

from .base import (
    Deconvolver,
    deconvolve,
    deconvolve_slices,
    deconvolving,
    deconvolving_slices,
)
from .guard import Guarded, Swing, guard, guarding, swing_of
from .hyper_laplacian import HyperLaplacian
from .irls import SparseIrls
from .light_noise import LightNoise, fit_noise
from .local_shrinkage import LocalShrinkage
from .noise import PlaneStatistics, measure, noise_level
from .richardson_lucy import RichardsonLucy
from .tiles import Tiled
from .total_variation import TotalVariation
from .trust import SlopeError, Trust, trusting
from .varying import deconvolve_varying, deconvolving_varying
from .verdict import Verdict, verdict, verdict_sentence
from .wiener import Wiener

__all__ = [
    "Deconvolver",
    "Guarded",
    "HyperLaplacian",
    "LightNoise",
    "LocalShrinkage",
    "PlaneStatistics",
    "RichardsonLucy",
    "SlopeError",
    "SparseIrls",
    "Swing",
    "Tiled",
    "TotalVariation",
    "Trust",
    "Verdict",
    "Wiener",
    "deconvolve",
    "deconvolve_slices",
    "deconvolve_varying",
    "deconvolving",
    "deconvolving_slices",
    "deconvolving_varying",
    "fit_noise",
    "guard",
    "guarding",
    "measure",
    "noise_level",
    "swing_of",
    "trusting",
    "verdict",
    "verdict_sentence",
]
