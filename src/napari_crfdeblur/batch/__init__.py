"""Many photos with one response and, if wanted, one PSF; what is done is not done again."""

from .base import Batch, BatchResult, Fate, Outcome, deblur_files, deblurring_files
from .shared import PsfOf

__all__ = [
    "Batch",
    "BatchResult",
    "Fate",
    "Outcome",
    "PsfOf",
    "deblur_files",
    "deblurring_files",
]
