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
from .noise import PlaneStatistics, measure, measure_channels, noise_level
from .richardson_lucy import RichardsonLucy
from .strength import Strengthened
from .tiles import Tiled
from .total_variation import TotalVariation
from .trust import Judged, SlopeError, Trust, judge, judging
from .varying import deconvolve_varying, deconvolving_varying
from .verdict import Verdict, verdict, verdict_sentence
from .wiener import Wiener

__all__ = [
    "Deconvolver",
    "Guarded",
    "HyperLaplacian",
    "Judged",
    "LightNoise",
    "LocalShrinkage",
    "PlaneStatistics",
    "RichardsonLucy",
    "SlopeError",
    "SparseIrls",
    "Strengthened",
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
    "judge",
    "judging",
    "measure",
    "measure_channels",
    "noise_level",
    "swing_of",
    "verdict",
    "verdict_sentence",
]
