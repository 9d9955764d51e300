"""Estimation of the camera response from profiles across straight edges."""

from .base import (
    ResponseEstimate,
    ResponseFit,
    ResponseStatus,
    estimate_response,
    estimating_response,
)
from .given import GivenResponse
from .paper import KnownPsf, MeanProfile, PolynomialFit, RankMinimization, RowScale, Tail

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
