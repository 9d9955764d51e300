"""The commands, by name."""

from .batch import batch
from .deblur import deblur, psf
from .estimate import estimate
from .repeat import repeat
from .simulate import demo, simulate

__all__ = ["batch", "deblur", "demo", "estimate", "psf", "repeat", "simulate"]
