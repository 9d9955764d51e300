"""Which pictures a report has, in rows, whatever the file that they go into."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from .._typing import Image
from ..profiles import ProfileGroup
from .content import Report
from .curves import draw_profiles, draw_response
from .pictures import detail, draw_edges, draw_photo, draw_psf, draw_psf_field

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    Draw = Callable[[Axes], object]

Margins = tuple[float, float]
BARE, TICKS, AXES = (0.0, 0.0), (0.2, 0.36), (0.42, 0.36)


@dataclass(frozen=True, slots=True)
class Panel:
    """One picture: its caption, width over height, and room for its labels.

    Parameters
    ----------
    caption : str
        Short title.
    aspect : float
        Width of the axes divided by their height.
    draw : callable
        Draws on empty axes.
    margins : (float, float)
        Room left of the axes and below them, in inches.
    """

    caption: str
    aspect: float
    draw: "Draw"
    margins: Margins = BARE


def edges_panel(report: Report) -> Panel | None:
    """The edges on the photo."""
    photo = report.photo
    if photo is None or not report.edges:
        return None

    def draw(ax: "Axes") -> None:
        draw_photo(ax, photo)
        draw_edges(ax, report.edges, report.groups)

    return Panel("Edges", aspect(photo), draw)


def curve_panels(report: Report) -> list[Panel]:
    """The profiles before and after, and the response."""
    found = []
    if report.groups:
        group = report.groups[0]
        found.append(_profiles("Profiles as recorded", group))
        if report.curves:
            profiles = partial(draw_profiles, group=group, curves=report.curves)
            found.append(Panel("Profiles linearized", 1.0, profiles, AXES))
    if report.responses:
        draw = partial(draw_response, responses=report.responses, references=report.references)
        found.append(Panel("Inverse response", 1.0, draw, AXES))
    return found


def photo_panels(report: Report) -> list[Panel]:
    """The photo before and after, further pictures, and the PSF."""
    shown: dict[str, Image] = {}
    if report.photo is not None and (report.sharp is not None or not report.edges):
        shown["Photo"] = report.photo
    if report.sharp is not None:
        shown["Deblurred"] = report.sharp
    shown |= report.pictures
    found = [_photo(caption, photo) for caption, photo in shown.items()]
    if report.trust is not None:
        believed = report.trust.believed
        believed = believed.reshape(-1, *believed.shape[-2:])[0]  # the slice that is shown
        found.append(_photo("What can be believed: black nothing, white all", believed))
    if report.psf is not None:
        psf = report.psf.psf
        shape = aspect(psf)
        found.append(Panel("Point spread function", shape, partial(draw_psf, psf=psf), TICKS))
    if report.field is not None:
        field = report.field
        draw = partial(draw_psf_field, field=field)
        found.append(Panel("PSFs across the photo", aspect(field.picture()), draw))
    return found


def detail_panels(report: Report) -> list[Panel]:
    """The part of the photo that changed most, before and after."""
    if report.photo is None or report.sharp is None:
        return []
    window = detail(report.photo, report.sharp)
    if window is None:
        return []
    return [
        _photo("Detail of the photo", report.photo[window]),
        _photo("Detail, deblurred", report.sharp[window]),
    ]


def panel_rows(report: Report) -> list[Sequence[Panel]]:
    """Rows of panels below the edges; rows without any are left out."""
    rows = [curve_panels(report), photo_panels(report), detail_panels(report)]
    return [row for row in rows if row]


def aspect(image: Image) -> float:
    """Width divided by height."""
    height, width = image.shape[:2]
    return float(width / height)


def _photo(caption: str, photo: Image) -> Panel:
    return Panel(caption, aspect(photo), partial(draw_photo, photo=photo))


def _profiles(caption: str, group: ProfileGroup) -> Panel:
    return Panel(caption, 1.0, partial(draw_profiles, group=group), AXES)
