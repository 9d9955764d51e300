"""A PSF from the blurred picture itself, without knowing the sharp one."""

from .xu_jia import XuJia

__all__ = ["XuJia"]
