"""Estimation of the camera response from profiles across straight edges."""

from .base import (
    ResponseEstimate,
    ResponseFit,
    ResponseStatus,
    estimate_response,
    estimating_response,
)
from .fitting import PolynomialFit
from .given import GivenResponse
from .known_psf import KnownPsf
from .mean_profile import MeanProfile
from .rank import RankMinimization, RowScale, Tail

__all__ = [
    "GivenResponse",
    "KnownPsf",
    "MeanProfile",
    "PolynomialFit",
    "RankMinimization",
    "ResponseEstimate",
    "ResponseFit",
    "ResponseStatus",
    "RowScale",
    "Tail",
    "estimate_response",
    "estimating_response",
]
