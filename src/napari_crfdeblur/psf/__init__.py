"""Point spread functions: shapes, what they do to edges, and how to find them."""

from .base import (
    Evidence,
    PsfEstimate,
    PsfEstimator,
    as_psf,
    centered,
    cleared,
    estimate_psf,
    estimating_psf,
)
from .blind import Fergus, L0Gradient, MinimalPixels, Portfolio, Shan, Variational, XuJia
from .field import Poses, PsfField
from .given import GivenPsf
from .parts import estimate_psf_field, estimating_psf_field
from .points import Beads, MotionPath, PsfAt, Streaks
from .projection import project
from .radon import RadonFit, RadonMap
from .shapes import camera_shake, delta, disk, gaussian, kernel_a, kernel_b, line
from .status import PsfStatus

__all__ = [
    "Beads",
    "Evidence",
    "Fergus",
    "GivenPsf",
    "L0Gradient",
    "MinimalPixels",
    "MotionPath",
    "Portfolio",
    "Poses",
    "PsfAt",
    "PsfEstimate",
    "PsfEstimator",
    "PsfField",
    "PsfStatus",
    "RadonFit",
    "RadonMap",
    "Shan",
    "Streaks",
    "Variational",
    "XuJia",
    "as_psf",
    "camera_shake",
    "centered",
    "cleared",
    "delta",
    "disk",
    "estimate_psf",
    "estimate_psf_field",
    "estimating_psf",
    "estimating_psf_field",
    "gaussian",
    "kernel_a",
    "kernel_b",
    "line",
    "project",
]
