"""The stage from edges to profiles: intensity across each edge, grouped by orientation."""

from .align import Alignment, CommonShape, EndPoints
from .base import ProfileGroup, ProfileSource, of_channel
from .group import ByEdge, ByOrientation, ByPolarity, Grouping
from .sample import Channels, sample_profiles, sampling_profiles

__all__ = [
    "Alignment",
    "ByEdge",
    "ByOrientation",
    "ByPolarity",
    "Channels",
    "CommonShape",
    "EndPoints",
    "Grouping",
    "ProfileGroup",
    "ProfileSource",
    "of_channel",
    "sample_profiles",
    "sampling_profiles",
]
