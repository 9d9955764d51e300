"""What came out, line by line, for whoever started the command."""

from collections.abc import Sequence

from ..deconvolution import verdict_sentence
from ..edges import Edge
from ..estimate import ResponseEstimate
from ..io import StoredCamera
from ..psf import PsfEstimate, PsfField, PsfStatus
from ..report import Report
from .terminal import say


def say_report(report: Report, camera: StoredCamera | None = None) -> None:
    """Edges, response and blur of a report."""
    say_edges(report.edges)
    say_responses(report.responses, camera)
    if report.psf:
        say_psf(report.psf)
    if report.field:
        say_field(report.field)
    if report.trust:
        say(f"result: {verdict_sentence(report.trust)}")


def say_camera(camera: StoredCamera) -> None:
    """Which camera it is, and what is known of it."""
    first, *others = camera.sentences()
    say(first)
    for sentence in others:
        say(f"  {sentence}")


def say_edges(edges: Sequence[Edge]) -> None:
    """How many edges are good."""
    if edges:
        say(f"edges: {sum(edge.good for edge in edges)} good of {len(edges)}")


def say_responses(found: Sequence[ResponseEstimate], camera: StoredCamera | None = None) -> None:
    """How far the response can be trusted, and why not further."""
    names = ["response"] if len(found) == 1 else ["response R", "response G", "response B"]
    for name, one in zip(names, found, strict=True):
        low, high = one.covered
        sentence = camera.verdict(one) if camera else one.status.value
        covered = f" (intensity {low:.2f} to {high:.2f})" if low < high else ""
        say(f"{name}: {sentence}{covered}")
        for finding in one.findings:
            say(f"  {finding.value}")


def say_psf(found: PsfEstimate) -> None:
    """How large the PSF is, and how far it can be trusted."""
    sides = " x ".join(map(str, reversed(found.psf.shape)))
    say(f"PSF: {sides} pixels; {found.sentence}")


def say_field(field: PsfField) -> None:
    """How many parts tell their PSF, and how far the camera turned."""
    statuses = [status for row in field.statuses for status in row]
    own = sum(status is not PsfStatus.BORROWED for status in statuses)
    say(
        f"parts: {own} of {len(statuses)} tell their PSF; the camera turned by "
        f"{field.diagnostics['turn']:.2f} degrees (standard deviation)"
    )
