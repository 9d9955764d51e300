"""What a session does, step by step: each function makes the step of one of its verbs."""

from collections.abc import Callable
from typing import Any

from ..step import Step
from .batch import BatchResult, restoring_files, restoring_layers
from .blur import estimating_psf, setting_psf
from .cameras import keeping_camera, looking_up_cameras
from .edges import ONE_SLICE, detecting_edges, joined, removing_edges, setting_edges
from .export import EXPORTS, exporting
from .large import restoring_into
from .response import estimating_response, following_edges, setting_response
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
    "EXPORTS",
    "ONE_SLICE",
    "REPEATABLE",
    "BatchResult",
    "comparing",
    "deblurring",
    "deconvolving",
    "detecting_edges",
    "estimating_psf",
    "estimating_response",
    "exporting",
    "following_edges",
    "joined",
    "keeping_camera",
    "linearizing",
    "looking_up_cameras",
    "previewing",
    "reapplying",
    "removing_edges",
    "restoring",
    "restoring_files",
    "restoring_into",
    "restoring_layers",
    "setting_edges",
    "setting_psf",
    "setting_response",
]

# Verbs of a session that are recorded, and the steps that do them again.
REPEATABLE: dict[str, Callable[..., Step[Any, Any]]] = {
    "detect_edges": detecting_edges,
    "set_edges": setting_edges,
    "estimate_response": estimating_response,
    "set_response": setting_response,
    "estimate_psf": estimating_psf,
    "set_psf": setting_psf,
    "linearize": linearizing,
    "deconvolve": deconvolving,
    "reapply": reapplying,
    "compare_with": comparing,
    "restore_into": restoring_into,
}
