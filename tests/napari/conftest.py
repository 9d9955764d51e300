"""The plugin in a plugin manager of its own, and viewers without a window."""

from collections.abc import Iterator
from typing import Any

import pytest
from napari.components import ViewerModel
from npe2 import PluginManager, PluginManifest

from napari_crfdeblur import Session
from napari_crfdeblur._napari.session.state import EdgeSet, Fitted
from napari_crfdeblur.estimate import MaximumLikelihood, Responses, estimate_response
from napari_crfdeblur.psf import camera_shake
from napari_crfdeblur.response import Gamma
from napari_crfdeblur.simulate import Camera, Simulated, simulate, slanted_edges

NAME = "napari-crfdeblur"
VERBS = (
    "detect_edges",
    "estimate_response",
    "linearize",
    "estimate_psf",
    "deconvolve",
    "reapply",
)


@pytest.fixture
def manifest() -> PluginManifest:
    """The manifest as napari finds it."""
    return PluginManifest.from_distribution(NAME)


@pytest.fixture
def plugin(npe2pm: Any, manifest: PluginManifest) -> Iterator[PluginManager]:
    """A plugin manager that knows napari's own readers and writers, and this plugin."""
    builtin = PluginManifest.from_distribution("napari")
    with npe2pm.tmp_plugin(manifest=builtin), npe2pm.tmp_plugin(manifest=manifest):
        yield npe2pm


@pytest.fixture
def viewer() -> ViewerModel:
    """A viewer without a window."""
    return ViewerModel()


@pytest.fixture(scope="session")
def blurred() -> Simulated:
    """Small tilted panels in color, blurred by camera shake, of known response and PSF."""
    psf = camera_shake(5, seed=3)
    rows, columns = (side + reach - 1 for side, reach in zip((150, 210), psf.shape, strict=True))
    camera = Camera(Gamma(1.8), noise=0.003)
    scene = slanted_edges((rows, columns), seed=12, pitch=70, channels=3)
    return simulate(scene, psf, camera, seed=1)


def on_panels(blurred: Simulated) -> Session:
    """A session of its own on that photo."""
    viewer = ViewerModel()
    return Session(viewer, viewer.add_image(blurred.photo, name="panels"))


@pytest.fixture(scope="session")
def found(blurred: Simulated) -> EdgeSet:
    """The edges of that photo, found once."""
    return on_panels(blurred).detect_edges()


@pytest.fixture(scope="session")
def fitted(found: EdgeSet) -> Fitted:
    """The response estimated from them, once."""
    estimate = estimate_response(found.groups, MaximumLikelihood())
    return Fitted(Responses((estimate,)), found.groups, found, method=MaximumLikelihood())


@pytest.fixture(scope="session")
def done(blurred: Simulated) -> Session:
    """A session in which every step was done; not to be changed."""
    session = on_panels(blurred)
    for verb in VERBS:
        getattr(session, verb)()
    return session


@pytest.fixture(scope="session")
def deblurred(blurred: Simulated) -> Session:
    """A session in which all was done at once; not to be changed."""
    session = on_panels(blurred)
    session.deblur()
    return session


@pytest.fixture
def edged(session: Session, found: EdgeSet) -> Session:
    """A session on that photo with its edges."""
    session.commit(session.photo, session.state.with_edges(found))
    return session


@pytest.fixture
def session(viewer: ViewerModel, blurred: Simulated) -> Session:
    """A session on that photo."""
    return Session(viewer, viewer.add_image(blurred.photo, name="panels"))
