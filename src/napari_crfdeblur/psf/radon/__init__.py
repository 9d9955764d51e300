"""A PSF from the profiles of straight edges alone: tomography of the blur."""

from .method import RadonFit

__all__ = ["RadonFit"]
