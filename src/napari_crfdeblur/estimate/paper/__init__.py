"""The estimators of Kim et al. 2012: a polynomial inverse response, three data terms."""

from .fitting import PolynomialFit
from .known_psf import KnownPsf
from .mean_profile import MeanProfile
from .rank import RankMinimization, RowScale, Tail

__all__ = ["KnownPsf", "MeanProfile", "PolynomialFit", "RankMinimization", "RowScale", "Tail"]
