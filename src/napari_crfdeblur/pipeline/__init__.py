"""The whole path from a blurred photo to a sharp one, told once; see :mod:`.path`."""

from .in_turns import find_psf_in_turns
from .intermediates import Intermediates
from .options import DeblurOptions, Drawn
from .path import DEFAULT_METHOD, PATH, Stage, edges_needed, suited_estimator, walking
from .profiled import profiles_for, profiling
from .record import Pixels, Record
from .repeat import Repeated, repeating
from .stack import PhotoStack, Restored, restoring_stack
from .verb import Deblurred, deblur, deblurring

__all__ = [
    "DEFAULT_METHOD",
    "PATH",
    "DeblurOptions",
    "Deblurred",
    "Drawn",
    "Intermediates",
    "PhotoStack",
    "Pixels",
    "Record",
    "Repeated",
    "Restored",
    "Stage",
    "deblur",
    "deblurring",
    "edges_needed",
    "find_psf_in_turns",
    "profiles_for",
    "profiling",
    "repeating",
    "restoring_stack",
    "suited_estimator",
    "walking",
]
