"""The blur in files: a PSF as a picture or an array, and all that is known of it as JSON."""

import json
from pathlib import Path

import numpy as np

from .._typing import FloatArray
from ..errors import CrfDeblurError
from ..io import check_output, psfs, read_psf, write_psf, write_text
from ..io.json_files import read_json
from ..io.records import from_record, to_record
from ..psf import PsfField

FORMAT, VERSION = "crfdeblur-psf", 1
JSON = ".json"
SUFFIXES = (*psfs.SUFFIXES, JSON)


def read_blur(path: Path) -> tuple[FloatArray, PsfField | None]:
    """Read a PSF, and those of the parts of a photo if the file has them.

    Parameters
    ----------
    path : Path
        As for :func:`~napari_crfdeblur.io.read_psf`, or JSON of :func:`write_blur`.

    Raises
    ------
    CrfDeblurError
        Missing, damaged, or no PSF.
    """
    if path.suffix.lower() == JSON:
        return _read_json(path)
    return read_psf(path), None


def write_blur(path: Path, psf: FloatArray, field: PsfField | None) -> None:
    """Write a PSF; of parts, all in JSON.

    Raises
    ------
    CrfDeblurError
        A kind of file that cannot hold it, or a place that cannot be written.
    """
    check_output(path, SUFFIXES)
    if path.suffix.lower() == JSON:
        content = {"format": FORMAT, "version": VERSION}
        content |= {"psf": to_record(psf), "field": to_record(field)}
        write_text(path, json.dumps(content, allow_nan=False) + "\n")
    elif field is not None:
        raise CrfDeblurError(f"{path}: the PSFs of parts are kept as .json; give such a name")
    else:
        write_psf(path, psf)


def _read_json(path: Path) -> tuple[FloatArray, PsfField | None]:
    content = read_json(path)
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise CrfDeblurError(f'{path}: not a PSF: "format" is not "{FORMAT}"; export one')
    if content.get("version") != VERSION:
        raise CrfDeblurError(f"{path}: made by a later version; update napari-crfdeblur")
    psf, field = (from_record(content.get(name)) for name in ("psf", "field"))
    if not isinstance(psf, np.ndarray) or not isinstance(field, PsfField | None):
        raise CrfDeblurError(f"{path}: the PSF is damaged; export it again")
    return psf, field
