"""Estimation of the camera response from profiles across straight edges."""

from .base import (
    Finding,
    ResponseEstimate,
    ResponseFit,
    Responses,
    ResponseStatus,
    estimate_response,
    estimate_responses,
    estimating_response,
    estimating_responses,
)
from .given import GivenResponse, given_responses
from .likelihood import MaximumLikelihood, NoiseModel
from .paper import KnownPsf, MeanProfile, PolynomialFit, RankMinimization, RowScale, Tail
from .per_channel import PerChannel

__all__ = [
    "Finding",
    "GivenResponse",
    "KnownPsf",
    "MaximumLikelihood",
    "MeanProfile",
    "NoiseModel",
    "PerChannel",
    "PolynomialFit",
    "RankMinimization",
    "ResponseEstimate",
    "ResponseFit",
    "ResponseStatus",
    "Responses",
    "RowScale",
    "Tail",
    "estimate_response",
    "estimate_responses",
    "estimating_response",
    "estimating_responses",
    "given_responses",
]
