"""The jobs of a session: each takes arrays and gives a record, and touches no layer."""

from .finding import (
    Other,
    finding_edge_set,
    fitting_response,
    following_edges,
    refining_edge_set,
    seeking_field,
    seeking_psf,
)
from .restoring import (
    Restoration,
    counting_clipped,
    linearizing_region,
    previewing,
    recording,
    restoring,
    sharpening,
)

__all__ = [
    "Other",
    "Restoration",
    "counting_clipped",
    "finding_edge_set",
    "fitting_response",
    "following_edges",
    "linearizing_region",
    "previewing",
    "recording",
    "refining_edge_set",
    "restoring",
    "seeking_field",
    "seeking_psf",
    "sharpening",
]
