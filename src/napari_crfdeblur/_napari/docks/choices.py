"""The methods that the widgets offer, by the names that the user reads."""

from typing import Any

from ...deconvolution import HyperLaplacian, RichardsonLucy, SparseIrls, Wiener
from ...estimate import (
    GivenResponse,
    MaximumLikelihood,
    MeanProfile,
    RankMinimization,
    Tail,
)
from ...pipeline import BLIND_ERROR
from ...psf import RadonFit, XuJia
from ...response import SRGB, Gamma, Identity, dorf_mean

# Names in napari's settings, which are those of the command line, and names in the widgets.
PREFERRED = {
    "likelihood": "maximum likelihood",
    "rank": "rank minimization",
    "mean": "mean profile",
    "gamma": "gamma",
    "srgb": "sRGB",
    "hyper-laplacian": "hyper-Laplacian",
    "irls": "sparse (IRLS)",
    "wiener": "Wiener",
    "richardson-lucy": "Richardson-Lucy",
}
AUTOMATIC = "automatic"
FROM_EDGES = "straight edges (Radon)"


def fits() -> dict[str, Any]:
    """How the response can be estimated."""
    return {
        "maximum likelihood": MaximumLikelihood(),
        "rank minimization": RankMinimization(),
        "rank minimization, all singular values": RankMinimization(Tail.ALL),
        "mean profile": MeanProfile(),
    }


def given() -> dict[str, Any]:
    """Responses that can be assumed."""
    return {
        "gamma": GivenResponse(Gamma(2.2)),
        "sRGB": GivenResponse(SRGB()),
        "mean of the DoRF cameras": GivenResponse(dorf_mean()),
        "linear": GivenResponse(Identity()),
    }


def psf_estimators() -> dict[str, Any]:
    """How the PSF can be estimated."""
    return {AUTOMATIC: None, "Xu & Jia": XuJia(), FROM_EDGES: RadonFit()}


def deconvolvers() -> dict[str, Any]:
    """How the blur can be undone."""
    return {
        AUTOMATIC: None,
        "hyper-Laplacian": HyperLaplacian(model_error=BLIND_ERROR),
        "sparse (IRLS)": SparseIrls(model_error=BLIND_ERROR),
        "Wiener": Wiener(model_error=BLIND_ERROR),
        "Richardson-Lucy": RichardsonLucy(),
    }
