"""What a session does, step by step: each function makes the step of one of its verbs."""

from .base import Effects, Level, Message, Step, apply
from .blur import estimating_psf, setting_psf
from .edges import detecting_edges, setting_edges
from .response import estimating_response, setting_response
from .restore import (
    comparing,
    deblurring,
    deconvolving,
    linearizing,
    previewing,
    reapplying,
    restoring,
)

__all__ = [
    "Effects",
    "Level",
    "Message",
    "Step",
    "apply",
    "comparing",
    "deblurring",
    "deconvolving",
    "detecting_edges",
    "estimating_psf",
    "estimating_response",
    "linearizing",
    "previewing",
    "reapplying",
    "restoring",
    "setting_edges",
    "setting_psf",
    "setting_response",
]
