"""PSFs that a photo shows as they are: streaks of lamps, points, beads, and paths drawn by hand."""

from .at import PsfAt
from .beads import Beads
from .motion import MotionPath
from .streaks import Streaks

__all__ = ["Beads", "MotionPath", "PsfAt", "Streaks"]
