"""What a report says: the parts of a result, its sentences and its figures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from dataclasses import field as default
from math import degrees

import numpy as np

from .._typing import FloatArray, Image
from ..deconvolution import Trust, verdict_sentence
from ..edges import Edge
from ..estimate import ResponseEstimate, ResponseStatus
from ..profiles import ProfileGroup
from ..psf import PsfEstimate, PsfField
from ..response import SRGB, Gamma, ResponseCurve

CHANNELS = ("red", "green", "blue")


def usual_curves() -> dict[str, ResponseCurve]:
    """What is often assumed of a camera, for comparison."""
    return {"gamma 2.2": Gamma(2.2), "sRGB": SRGB()}


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """The content of one page; parts that are missing are left out.

    Parameters
    ----------
    title : str
        Name of the photo, or of what was done.
    photo : ndarray, shape (M, N), (M, N, 3) or (M, N, 4), optional
        The photo, or the first of several: uint8, uint16 or float in [0, 1].
    edges : sequence of Edge
        Edges of `photo`, the rejected ones too.
    groups : sequence of ProfileGroup
        Profiles of all photos, the largest group first.
    responses : sequence of ResponseEstimate
        One for all channels, or one for each.
    psf : PsfEstimate, optional
        Point spread function.
    field : PsfField, optional
        The point spread functions of all parts of the photo.
    sharp : ndarray, the shape of `photo`, optional
        The photo deblurred.
    trust : Trust, optional
        How far the deblurred photo can be believed.
    pictures : mapping of str to ndarray
        Further photos to be shown beside it, by caption.
    references : mapping of str to ResponseCurve
        Curves drawn beside the estimate, by name.
    figures : mapping of str to str
        Further rows of the table, by name.
    notes : sequence of str
        Further sentences.
    """

    title: str
    photo: Image | None = None
    edges: Sequence[Edge] = ()
    groups: Sequence[ProfileGroup] = ()
    responses: Sequence[ResponseEstimate] = ()
    psf: PsfEstimate | None = None
    field: PsfField | None = None
    sharp: Image | None = None
    trust: Trust | None = None
    pictures: Mapping[str, Image] = default(default_factory=dict)
    references: Mapping[str, ResponseCurve] = default(default_factory=usual_curves)
    figures: Mapping[str, str] = default(default_factory=dict)
    notes: Sequence[str] = ()

    @property
    def curves(self) -> list[ResponseCurve]:
        """The curve of all channels, or one for each."""
        return [estimate.curve for estimate in self.responses]


def channel_names(count: int) -> list[str]:
    """Names of so many responses, none for a single one."""
    return [""] if count == 1 else list(CHANNELS)


def sentences(report: Report) -> dict[str, str]:
    """How far each part can be trusted, in words."""
    found: dict[str, list[str]] = {}
    for name, estimate in zip(channel_names(len(report.responses)), report.responses, strict=False):
        reasons = [finding.value for finding in estimate.findings]
        found.setdefault("; ".join([estimate.status.value, *reasons]), []).append(name)
    said = {}
    for status, names in found.items():
        which = f" ({', '.join(names)})" if len(found) > 1 else ""
        said[f"Response{which}"] = status + "."
    if report.psf is not None:
        said["PSF"] = report.psf.sentence + "."
    if report.trust is not None:
        said["Result"] = verdict_sentence(report.trust) + "."
    for number, note in enumerate(report.notes, start=1):
        said["Note" if len(report.notes) == 1 else f"Note {number}"] = note
    return said


def figure_table(report: Report) -> dict[str, str]:
    """The figures of a report, by name, in words and units."""
    rows: dict[str, str] = {}
    if report.photo is not None:
        height, width = report.photo.shape[:2]
        rows["photo"] = f"{width} x {height} px, {report.photo.dtype}"
    if report.edges:
        good = [edge for edge in report.edges if edge.good]
        rows["edges"] = f"{len(good)} good, {len(report.edges) - len(good)} rejected"
        if good:
            rows["width of the edges"] = f"{np.median([e.width for e in good]):.1f} px (median)"
    if report.groups:
        rows |= _of_groups(report)
    rows |= _of_responses(report.responses)
    if report.psf is not None:
        rows["PSF"] = "{1} x {0} px".format(*report.psf.psf.shape)
        rows |= {f"PSF, {k}": f"{v:.3g}" for k, v in report.psf.diagnostics.items()}
    if report.field is not None:
        rows["PSFs of parts"] = "{} x {}".format(*report.field.grid)
        rows |= {f"PSFs of parts, {k}": f"{v:.3g}" for k, v in report.field.diagnostics.items()}
    if report.trust is not None:
        rows["believed"] = f"{report.trust.believed.mean():.0%} of what was changed, on average"
    return rows | dict(report.figures)


def _of_groups(report: Report) -> dict[str, str]:
    photos = len({source.image for group in report.groups for source in group.sources})
    where = f" of {photos} photos" if photos > 1 else ""
    count, groups = sum(map(len, report.groups)), len(report.groups)
    rows = {"profiles": f"{count} in {groups} group{'s' * (groups != 1)}{where}"}
    largest = report.groups[0]
    if len(largest) >= 2:
        rows["their spread, as recorded"] = f"{spread(largest):.1%} of the range"
        if report.curves:
            rows["their spread, linearized"] = f"{spread(largest, report.curves):.1%} of the range"
    return rows


def _of_responses(responses: Sequence[ResponseEstimate]) -> dict[str, str]:
    """Figures of the responses, those of several channels in one row."""
    rows: dict[str, list[str]] = {}
    covered = [e.covered for e in responses if e.status is not ResponseStatus.GIVEN]
    if any(low < high for low, high in covered):
        ranges = [f"{low:.2f}-{high:.2f}" if low < high else "nothing" for low, high in covered]
        rows["covered intensity"] = ranges
    for estimate in responses:
        for name, value in estimate.diagnostics.items():
            if name not in ("groups", "profiles"):  # counted above
                rows.setdefault(f"response, {name}", []).append(f"{value:.3g}")
    return {name: " / ".join(values) for name, values in rows.items()}


def normalized(group: ProfileGroup, curves: Sequence[ResponseCurve] = ()) -> FloatArray:
    """Profiles from 0 on one side to 1 on the other, shape (J, M).

    Parameters
    ----------
    group : ProfileGroup
        Profiles; a row whose sides are equal is left out.
    curves : sequence of ResponseCurve
        One for all channels or one for each, undone first; none leaves the recorded intensity.
    """
    values, sides = group.intensity.copy(), group.sides.copy()
    channel = np.array([source.channel for source in group.sources], dtype=int)
    for number, curve in enumerate(curves):
        own = channel == number if len(curves) > 1 else np.ones(len(group), dtype=bool)
        values[own], sides[own] = (curve.to_irradiance(x[own]) for x in (values, sides))
    extent = np.diff(sides, axis=1)
    steps = extent[:, 0] != 0
    return np.asarray((values[steps] - sides[steps, :1]) / extent[steps])


def spread(group: ProfileGroup, curves: Sequence[ResponseCurve] = ()) -> float:
    """Distance of normalized profiles from their median: root mean square of the middle row.

    The middle one of all rows, since a few faint edges, whose noise is scaled up most, would
    hide what the others show.
    """
    profiles = normalized(group, curves)
    square = (profiles - np.median(profiles, axis=0)) ** 2
    return float(np.median(np.sqrt(square.mean(axis=1))))


def direction(of: ProfileGroup | Edge) -> str:
    """Direction of an edge, or of those of a group, counterclockwise from the horizontal."""
    return f"{round(90 - degrees(of.orientation)) % 180}°"
