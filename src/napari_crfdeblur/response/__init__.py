"""Camera response curves: how recorded intensity follows from light."""

from .base import ResponseCurve
from .basis import Emor, dorf_mean, emor_table
from .parametric import SRGB, Gamma, GeneralizedGamma, Identity, Polynomial
from .prior import Cameras, ResponsePrior, around
from .tabulated import Tabulated, monotone
from .tuned import Tuned, tuned

__all__ = [
    "SRGB",
    "Cameras",
    "Emor",
    "Gamma",
    "GeneralizedGamma",
    "Identity",
    "Polynomial",
    "ResponseCurve",
    "ResponsePrior",
    "Tabulated",
    "Tuned",
    "around",
    "dorf_mean",
    "emor_table",
    "monotone",
    "tuned",
]
