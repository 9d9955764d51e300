"""Deconvolution: from a linear image and its PSF to a sharper linear image."""

from .base import Deconvolver, deconvolve, deconvolving
from .hyper_laplacian import HyperLaplacian
from .irls import SparseIrls
from .noise import noise_level
from .richardson_lucy import RichardsonLucy
from .wiener import Wiener

__all__ = [
    "Deconvolver",
    "HyperLaplacian",
    "RichardsonLucy",
    "SparseIrls",
    "Wiener",
    "deconvolve",
    "deconvolving",
    "noise_level",
]
