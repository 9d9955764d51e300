"""What the user prefers: the plugin's page in napari's settings."""

from dataclasses import dataclass
from pathlib import Path

from npe2 import PluginManager

PLUGIN = "napari-crfdeblur"


@dataclass(frozen=True, slots=True)
class Preferences:
    """What the widgets start with; the manifest's ``configurations`` has the same defaults.

    Parameters
    ----------
    blur_extent : float or None
        Largest width of a blurred edge in pixels; None judges it from the photo.
    response : str
        ``likelihood`` (maximum likelihood), ``rank`` (rank minimization), ``mean`` (mean
        profile), ``gamma`` (2.2) or ``srgb``.
    deconvolution : str
        ``local-shrinkage``, ``hyper-laplacian``, ``irls``, ``total-variation``, ``wiener`` or
        ``richardson-lucy``.
    compare : bool
        Whether a result with gamma 2.2 is put beside every restored photo.
    live : bool
        Whether the response is estimated again when the edges change.
    cameras : str
        Folder of stored cameras; none if empty.
    """

    blur_extent: float | None = None
    response: str = "likelihood"
    deconvolution: str = "local-shrinkage"
    compare: bool = False
    live: bool = True
    cameras: str = ""


def preferences() -> Preferences:
    """Those of napari's settings, or the defaults where the plugin is not registered."""
    if PLUGIN not in PluginManager.instance():
        return Preferences()
    from napari.settings import get_plugin_settings

    # It lacks plugins that were registered after its first use, or disabled.
    settings = get_plugin_settings().get(PLUGIN)
    if settings is None:
        return Preferences()
    chosen = settings.defaults
    return Preferences(
        blur_extent=chosen.blur_extent or None,  # 0 in the settings, which know no "automatic"
        response=chosen.response,
        deconvolution=chosen.deconvolution,
        compare=chosen.compare,
        live=chosen.live,
        cameras=chosen.cameras,
    )


def prefer_cameras(folder: Path) -> None:
    """Keep a folder of stored cameras in napari's settings, where the plugin has a page there."""
    if PLUGIN not in PluginManager.instance():
        return
    from napari.settings import get_plugin_settings

    settings = get_plugin_settings().get(PLUGIN)
    if settings is not None:
        settings.defaults.cameras = str(folder)
