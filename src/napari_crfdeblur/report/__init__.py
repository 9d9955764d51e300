"""Pictures of what was found, on one page: the stages of a result, side by side."""

from .content import Report
from .curves import draw_profiles, draw_response, move_curves, move_profiles
from .pictures import draw_edges, draw_photo, draw_psf
from .write import SUFFIXES, write_report

__all__ = [
    "SUFFIXES",
    "Report",
    "draw_edges",
    "draw_photo",
    "draw_profiles",
    "draw_psf",
    "draw_response",
    "move_curves",
    "move_profiles",
    "write_report",
]
