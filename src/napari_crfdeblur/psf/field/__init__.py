"""PSFs that differ across a picture: those of its parts, and the motion behind them."""

from .base import PsfField
from .poses import Poses
from .regions import estimate_psf_field, estimating_psf_field, grid_of

__all__ = ["Poses", "PsfField", "estimate_psf_field", "estimating_psf_field", "grid_of"]
