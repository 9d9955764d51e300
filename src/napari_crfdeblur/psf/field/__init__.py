"""PSFs that differ from place to place."""

from .base import PsfField
from .poses import Poses

__all__ = ["Poses", "PsfField"]
