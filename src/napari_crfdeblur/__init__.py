"""Estimate a camera's response from a blurred photo, and deblur it in linear light.

One verb per stage: :func:`find_edges`, :func:`sample_profiles`, :func:`estimate_response`,
:func:`linearize`, :func:`estimate_psf`, :func:`deconvolve`, :func:`reapply`; and
:func:`deblur` for the whole path; :class:`Session` does the same on the layers of a napari
viewer. Each stage's methods are objects of its module, for example
``napari_crfdeblur.deconvolution.HyperLaplacian``.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

from ._version import __version__

if TYPE_CHECKING:
    from ._napari.session.facade import Session as Session
    from .deconvolution import deconvolve
    from .edges import Edge, find_edges, refine_edges
    from .errors import CrfDeblurError
    from .estimate import ResponseEstimate, estimate_response
    from .pipeline import DeblurOptions, Deblurred, deblur
    from .profiles import ProfileGroup, sample_profiles
    from .psf import PsfEstimate, estimate_psf
    from .response import ResponseCurve, linearize, reapply

# All but Session, which needs napari: `import *` is for those without it, too.
__all__ = [
    "CrfDeblurError",
    "DeblurOptions",
    "Deblurred",
    "Edge",
    "ProfileGroup",
    "PsfEstimate",
    "ResponseCurve",
    "ResponseEstimate",
    "__version__",
    "deblur",
    "deconvolve",
    "estimate_psf",
    "estimate_response",
    "find_edges",
    "linearize",
    "reapply",
    "refine_edges",
    "sample_profiles",
]

# Where each name comes from; loaded on first use, so that the command starts at once.
_HOMES = {
    "CrfDeblurError": "errors",
    "DeblurOptions": "pipeline",
    "Deblurred": "pipeline",
    "Edge": "edges",
    "ProfileGroup": "profiles",
    "PsfEstimate": "psf",
    "ResponseCurve": "response",
    "ResponseEstimate": "estimate",
    "Session": "_napari.session.facade",
    "deblur": "pipeline",
    "deconvolve": "deconvolution",
    "estimate_psf": "psf",
    "estimate_response": "estimate",
    "find_edges": "edges",
    "linearize": "response",
    "reapply": "response",
    "refine_edges": "edges",
    "sample_profiles": "profiles",
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name == "Session" and find_spec("napari") is None:
        raise ImportError("Session works on the layers of napari: install napari 0.9 or newer")
    value = getattr(import_module(f".{_HOMES[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "Session"]
