"""Which files a command reads and writes, told before it begins."""

import os
from argparse import Namespace
from collections.abc import Iterable, Iterator
from pathlib import Path

from ..errors import CrfDeblurError
from ..io import Output, Outputs, check_apart, deblur_records
from ..io import edges as edge_files
from ..io.files import check_input
from ..large.sources import ZARR
from ..report import SUFFIXES as REPORTS

READ = ("photo", "photos", "edges", "psf", "response", "prior", "record_file")
"""Options that name files to be read, some of them among other things."""


def writing(
    arguments: Namespace, outputs: Iterable[Output], folders: Iterable[Path] = ()
) -> Outputs:
    """All outputs of a command, its report and edges among them.

    Parameters
    ----------
    arguments : Namespace
    outputs : iterable of Output
        Those that are not options of their own.
    folders : iterable of Path
        Made if they are missing.

    Raises
    ------
    CrfDeblurError
        A photo is missing, or one output would take the place of a stored camera.
    """
    for photo in _photos(arguments):
        if not photo.is_dir():
            check_input(photo)  # before a folder is missed that the output would be in
    planned = [*outputs, *_extras(arguments)]
    check_apart(_stored(arguments), [each.path for each in planned])
    return Outputs(files_read(arguments), planned, folders)


def photo_or_zarr(path: Path, suffixes: tuple[str, ...]) -> Output:
    """A file; or, if it ends so, a folder of zarr."""
    return Output(path, suffixes, folder=path.suffix.lower() == ZARR and ZARR in suffixes)


def file_beside(path: Path, name: str) -> Path:
    """A file of another name in the same folder.

    Raises
    ------
    CrfDeblurError
        The path has no name of its own, such as that of the folder which holds all others.
    """
    if not path.name:
        raise CrfDeblurError(f"{path}: has no name to make one of; give a file, or a name with -o")
    return path.with_name(name)


def files_read(arguments: Namespace) -> list[Path]:
    """All that the options name and that is there, be it meant as a file or not."""
    named = [value for name in READ if (value := getattr(arguments, name, None)) is not None]
    texts = [text for value in named for text in (value if isinstance(value, list) else [value])]
    return [Path(text) for text in texts if os.path.lexists(text)]


def _photos(arguments: Namespace) -> list[Path]:
    photo = getattr(arguments, "photo", None)
    return [photo] if photo else getattr(arguments, "photos", [])


def _extras(arguments: Namespace) -> Iterator[Output]:
    if report := getattr(arguments, "report", None):
        yield Output(report, REPORTS)
    if record := getattr(arguments, "record", None):
        yield Output(record, deblur_records.SUFFIXES)
    if edges := getattr(arguments, "save_edges", None):
        yield Output(edges, edge_files.SUFFIXES)


def _stored(arguments: Namespace) -> list[Path]:
    """The files of stored cameras."""
    folder = getattr(arguments, "cameras", None)
    return sorted(folder.glob("*.json")) if folder else []
