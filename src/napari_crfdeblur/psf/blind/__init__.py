"""A PSF from the blurred picture itself, without knowing the sharp one."""

from .fergus import Fergus
from .shan import Shan
from .variational import Variational
from .xu_jia import XuJia

__all__ = ["Fergus", "Shan", "Variational", "XuJia"]
