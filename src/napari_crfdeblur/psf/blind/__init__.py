"""A PSF from the blurred picture itself, without knowing the sharp one."""

from .fergus import Fergus
from .l0_gradient import L0Gradient
from .minimal_pixels import MinimalPixels
from .portfolio import Portfolio
from .shan import Shan
from .variational import Variational
from .xu_jia import XuJia

__all__ = ["Fergus", "L0Gradient", "MinimalPixels", "Portfolio", "Shan", "Variational", "XuJia"]
