"""Camera response curves: how recorded intensity follows from light."""

from .base import ResponseCurve
from .basis import Emor, dorf_mean, emor_table
from .parametric import SRGB, Gamma, GeneralizedGamma, Identity, Polynomial
from .tabulated import Tabulated, monotone
from .tuned import Tuned, tuned

__all__ = [
    "SRGB",
    "Emor",
    "Gamma",
    "GeneralizedGamma",
    "Identity",
    "Polynomial",
    "ResponseCurve",
    "Tabulated",
    "Tuned",
    "dorf_mean",
    "emor_table",
    "monotone",
    "tuned",
]
