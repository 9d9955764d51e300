"""Estimation of the camera response from profiles across straight edges."""

from .base import (
    Finding,
    ResponseEstimate,
    ResponseFit,
    ResponseStatus,
    estimate_response,
    estimating_response,
)
from .given import GivenResponse
from .likelihood import MaximumLikelihood, NoiseModel
from .paper import KnownPsf, MeanProfile, PolynomialFit, RankMinimization, RowScale, Tail

__all__ = [
    "Finding",
    "GivenResponse",
    "KnownPsf",
    "MaximumLikelihood",
    "MeanProfile",
    "NoiseModel",
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
