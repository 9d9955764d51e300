"""PSFs that a photo shows as they are: streaks of lamps, points, beads, and paths drawn by hand."""

from .at import SMALLEST_BOX, PsfAt
from .beads import Beads
from .motion import MotionPath
from .streaks import Streaks

__all__ = ["SMALLEST_BOX", "Beads", "MotionPath", "PsfAt", "Streaks"]
