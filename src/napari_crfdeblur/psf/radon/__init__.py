"""A PSF from the profiles of straight edges alone: tomography of the blur."""

from .method import RadonFit, estimate_psf_from_profiles, estimating_psf_from_profiles

__all__ = ["RadonFit", "estimate_psf_from_profiles", "estimating_psf_from_profiles"]
