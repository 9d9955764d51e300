"""The methods that the widgets offer, by the names that the user reads."""

from typing import Any

from magicgui.widgets import ComboBox

from ...estimate import GivenResponse
from ...methods import DECONVOLUTIONS, PSFS, RESPONSES, named
from ...response import SRGB, Gamma, Identity, dorf_mean

ASSUMED = {"gamma": "gamma", "srgb": "sRGB"}  # responses that the settings can assume
# Names in napari's settings, which are those of the command line, and names in the widgets.
PREFERRED = ASSUMED | {each.word: each.label for each in (*RESPONSES, *DECONVOLUTIONS)}
AUTOMATIC = "automatic"
ONE = (1, 1)  # regions: magicgui does not tell of a choice that is None
FROM_EDGES = named(PSFS, "edges").label
WITH_EDGES = {FROM_EDGES, named(PSFS, "radon-map").label}  # wherever in the photo they lie


def fits() -> dict[str, Any]:
    """How the response can be estimated."""
    return {each.label: each.make() for each in RESPONSES}


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
    return {AUTOMATIC: None} | {each.label: each.make() for each in PSFS}


def regions_box() -> ComboBox:
    """Asks for the parts of a photo that get a PSF each."""
    grids = [(2, 2), (3, 3), (3, 4), (4, 3), (4, 4), (4, 6)]
    choices = [("1 (one PSF)", ONE), *(("{} x {}".format(*grid), grid) for grid in grids)]
    return ComboBox(
        label="regions",
        choices=choices,
        value=ONE,
        tooltip="rows x columns of parts of the photo, each of which gets a PSF of its own: for a "
        "camera that turned; it takes as much longer as there are parts",
    )


def chosen_regions(box: ComboBox) -> tuple[int, int] | None:
    """Rows and columns of the parts that were asked for; None for one PSF of the whole."""
    grid: tuple[int, int] = box.value
    return None if grid == ONE else grid


def deconvolvers() -> dict[str, Any]:
    """How the blur can be undone."""
    return {AUTOMATIC: None} | {each.label: each.make() for each in DECONVOLUTIONS}
