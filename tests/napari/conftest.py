"""The plugin in a plugin manager of its own, and viewers without a window."""

from collections.abc import Iterator
from typing import Any

import pytest
from napari.components import ViewerModel
from npe2 import PluginManager, PluginManifest

NAME = "napari-crfdeblur"


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
