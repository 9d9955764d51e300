"""Camera response curves: how recorded intensity follows from light, and both ways between."""

from .base import ResponseCurve
from .basis import Emor, dorf_mean, emor_table
from .linear import (
    Response,
    clipped_share,
    linearize,
    linearizing,
    reapply,
    reapplying,
)
from .parametric import SRGB, Gamma, GeneralizedGamma, Identity, Polynomial
from .prior import Cameras, ResponsePrior, around
from .saturation import clipped_light, clipped_pixels
from .tabulated import Tabulated, monotone
from .tuned import Tuned, tuned
from .worth import pixel_worth

__all__ = [
    "SRGB",
    "Cameras",
    "Emor",
    "Gamma",
    "GeneralizedGamma",
    "Identity",
    "Polynomial",
    "Response",
    "ResponseCurve",
    "ResponsePrior",
    "Tabulated",
    "Tuned",
    "around",
    "clipped_light",
    "clipped_pixels",
    "clipped_share",
    "dorf_mean",
    "emor_table",
    "linearize",
    "linearizing",
    "monotone",
    "pixel_worth",
    "reapply",
    "reapplying",
    "tuned",
]
