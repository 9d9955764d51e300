"""The PSF likely for all sharp pictures: Fergus et al. (2006)."""

from .method import Fergus

__all__ = ["Fergus"]
