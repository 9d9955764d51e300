"""The most probable response: a likelihood of the recorded profiles and a prior of cameras."""

from .live import LiveFit
from .method import MaximumLikelihood
from .noise_model import NoiseModel

__all__ = ["LiveFit", "MaximumLikelihood", "NoiseModel"]
