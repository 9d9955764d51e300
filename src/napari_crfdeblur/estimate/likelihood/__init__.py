"""The most probable response: a likelihood of the recorded profiles and a prior of cameras."""

from .method import MaximumLikelihood
from .noise import NoiseModel

__all__ = ["MaximumLikelihood", "NoiseModel"]
