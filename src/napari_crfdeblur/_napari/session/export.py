"""Steps that write files: the report, plots, and everything else that a session holds."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from ... import arguments
from ...errors import CrfDeblurError
from ...io import check_output, write_edges, write_responses, write_text
from ...io.files import replacing
from ...progress import Job, Progress
from ...report import (
    Report,
    draw_edges,
    draw_photo,
    draw_profiles,
    draw_response,
    write_report,
)
from ...report.content import usual_curves
from ..blur_files import write_blur
from ..blurs import draw_blur, seen
from ..pixels import source_of
from ..script import as_script
from .record import session_record
from .step import Step, at_once
from .workspace import Workspace

if TYPE_CHECKING:
    from matplotlib.axes import Axes


PLOTS = (".png", ".svg", ".pdf")
Write: TypeAlias = Callable[[Path], None]
"""Writes what was taken from a session when the step was made; safe in any thread."""


class ExportVerbs(Workspace):
    """The verb of a session that writes parts of it to files."""

    def export(self, what: str, path: Path | str) -> Path:
        """Write a part of the session to a file.

        Parameters
        ----------
        what : str
            ``report``, ``response``, ``edges``, ``PSF``, ``record``, ``Python script``, or
            ``plot of the`` ``response``, ``profiles``, ``edges`` or ``PSF``.
        path : Path
            Its suffix says the kind: ``.html`` or ``.png`` for the report, ``.json`` or
            ``.csv`` for edges, ``.npy``, ``.tif``, ``.png`` or ``.json`` for the PSF (only the
            last keeps those of all parts), ``.png``, ``.svg`` or ``.pdf`` for plots, ``.json``
            and ``.py`` for the rest.

        Raises
        ------
        CrfDeblurError
            There is no such part yet, or the file cannot be written.
        """
        return self.do(exporting(self, what, path))

    def save(self, path: Path | str) -> None:
        """Save what was done, to be loaded and repeated."""
        self.export("record", path)


def exporting(session: Workspace, what: str, path: Path | str) -> Step[Path, Path]:
    """Step of :meth:`ExportVerbs.export`."""
    if what not in EXPORTS:
        raise arguments.refusal(f"one of {', '.join(EXPORTS)}", what)
    prepare, suffixes = EXPORTS[what]
    check_output(Path(path), suffixes)
    write = prepare(session)

    def job() -> Job[Path]:
        yield Progress(f"writing the {what}", 0, 1)
        write(Path(path))
        return Path(path)

    @at_once
    def finish(written: Path) -> Path:
        session.say(f"wrote {written}")
        return written

    return Step(f"exporting the {what}", job(), finish)


def _report(session: Workspace) -> Write:
    photo, source = session.source()
    state = session.state
    plane = state.edges.plane if state.edges else session.plane(None)
    found = state.edges.groups if state.edges else ()
    fitted = state.fitted
    restored = None if state.restored is None else source_of(state.restored, session.white)
    whole = restored is not None and restored.shape == source.shape

    def write(path: Path) -> None:
        report = Report(
            title=photo.name,
            photo=source.photo(plane),
            edges=state.edges.edges if state.edges else (),
            groups=(fitted.groups if fitted else ()) or found,
            responses=fitted.estimates if fitted else (),
            psf=None if state.psf is None else replace(state.psf, psf=seen(state.psf.psf)),
            field=state.field,
            sharp=restored.photo(plane) if restored is not None and whole else None,
        )
        write_report(path, report)

    return write


def _response(session: Workspace) -> Write:
    content = session.required_response().estimates
    return lambda path: write_responses(path, content)


def _edges(session: Workspace) -> Write:
    content = session.required_edges().edges
    return lambda path: write_edges(path, content)


def _psf(session: Workspace) -> Write:
    content = session.required_psf().psf, session.state.field
    return lambda path: write_blur(path, *content)


def _record(session: Workspace) -> Write:
    content = session_record(session)
    return lambda path: write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def _script(session: Workspace) -> Write:
    content = as_script(session_record(session))
    return lambda path: write_text(path, content)


def _response_plot(session: Workspace) -> Write:
    responses = session.required_response().estimates
    return partial(_plot, lambda ax: draw_response(ax, responses, usual_curves()))


def _profile_plot(session: Workspace) -> Write:
    groups, fitted = session.required_edges().groups, session.state.fitted
    if not groups:
        raise CrfDeblurError("there are no profiles: all edges were rejected")
    curves = [estimate.curve for estimate in fitted.estimates] if fitted else []
    return partial(_plot, lambda ax: draw_profiles(ax, groups[0], curves))


def _edge_plot(session: Workspace) -> Write:
    found, (_, source) = session.required_edges(), session.source()

    def draw(ax: "Axes") -> None:
        draw_photo(ax, source.photo(found.plane))
        draw_edges(ax, found.edges, found.groups)
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, 0), fontsize=7, frameon=False)

    return partial(_plot, draw)


def _psf_plot(session: Workspace) -> Write:
    blur = session.required_blur()
    return partial(_plot, lambda ax: draw_blur(ax, blur))


EXPORTS: dict[str, tuple[Callable[[Workspace], Write], tuple[str, ...]]] = {
    "report": (_report, (".html", ".png")),
    "response": (_response, (".json",)),
    "edges": (_edges, (".json", ".csv")),
    "PSF": (_psf, (".npy", ".tif", ".png", ".json")),
    "record": (_record, (".json",)),
    "Python script": (_script, (".py",)),
    "plot of the response": (_response_plot, PLOTS),
    "plot of the profiles": (_profile_plot, PLOTS),
    "plot of the edges": (_edge_plot, PLOTS),
    "plot of the PSF": (_psf_plot, PLOTS),
}
"""What can be written, by the name that the user reads, and in which kinds of file."""


def _plot(draw: "Callable[[Axes], object]", path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.4), dpi=160, layout="constrained")
    draw(figure.add_subplot())
    with replacing(path) as temporary:
        figure.savefig(temporary, format=path.suffix[1:].lower())
