"""A report as a file: one picture or one page of HTML."""

from pathlib import Path

from ..io.files import check_output, replacing
from .content import Report

SUFFIXES = (".html", ".png")


def write_report(path: Path, report: Report) -> None:
    """Write a report of one page, whole or not at all.

    Parameters
    ----------
    path : Path
        Ends in ``.html``, for one self-contained file, or in ``.png``, for one picture.
    report : Report
        What is shown.

    Raises
    ------
    CrfDeblurError
        The file cannot be written.
    """
    check_output(path, SUFFIXES)
    with replacing(path) as temporary:
        if path.suffix.lower() == ".png":
            from .page import page

            page(report).savefig(temporary, format="png")
        else:
            from .html import html

            temporary.write_text(html(report), encoding="utf-8")
