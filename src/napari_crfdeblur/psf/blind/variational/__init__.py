"""The PSF likely for all sharp pictures with sparse gradients: Levin et al., Wipf & Zhang."""

from .method import Variational

__all__ = ["Variational"]
