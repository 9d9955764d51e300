"""Records of what was done with a photo, from and to JSON files."""

import json
from pathlib import Path
from typing import Any

from .. import arguments
from ..errors import CrfDeblurError, about
from ..pipeline import Record
from .files import check_output, write_text
from .json_files import read_json
from .records import from_record, to_record

FORMAT, VERSION = "crfdeblur-record", 1
SUFFIXES = (".json",)
WHAT = "a record of what was done with a photo"


def record_content(record: Record) -> dict[str, Any]:
    """What a file of a record holds, as ``json`` takes it."""
    return {"format": FORMAT, "version": VERSION, "record": to_record(record)}


def write_record(path: Path | str, record: Record) -> None:
    """Write a record as JSON, whole or not at all."""
    path = arguments.path(path)
    arguments.instance(record, Record, "a Record")
    check_output(path, SUFFIXES)
    write_text(path, json.dumps(record_content(record), indent=1, allow_nan=False) + "\n")


def read_record(path: Path | str) -> Record:
    """Read what was done with a photo, so that it can be repeated.

    Raises
    ------
    CrfDeblurError
        Missing, not a record, damaged, or of another version.
    """
    path = arguments.path(path)
    return record_from(read_json(path), str(path))


def record_from(content: Any, where: str) -> Record:
    """The record in what a file holds, or in the metadata of a layer.

    Parameters
    ----------
    content : object
        As :func:`record_content` made it, or as ``json`` read it; more keys are passed over.
    where : str
        Where it came from, for messages, such as the name of the file.

    Raises
    ------
    CrfDeblurError
        Not a record, damaged, or of another version.
    """
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise CrfDeblurError(f'{where}: "format" is not "{FORMAT}"; give {WHAT}')
    if content.get("version") != VERSION:
        raise CrfDeblurError(
            f"{where}: records of version {content.get('version')!r:.20} are not known; "
            "update napari-crfdeblur, or do it again with this version"
        )
    try:
        record = from_record(content.get("record"))
    except CrfDeblurError as error:
        raise about(where, error) from error
    if not isinstance(record, Record):
        raise CrfDeblurError(f"{where}: the record is missing or damaged; give {WHAT}")
    return record
