"""A PSF from the profiles of straight edges: tomography of the blur."""

from .map_method import RadonMap
from .method import RadonFit

__all__ = ["RadonFit", "RadonMap"]
