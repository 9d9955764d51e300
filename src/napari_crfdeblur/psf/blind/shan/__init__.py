"""Picture and PSF most probable together: Shan, Jia & Agarwala (2008)."""

from .method import Shan

__all__ = ["Shan"]
