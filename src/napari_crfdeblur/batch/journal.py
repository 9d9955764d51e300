"""What a batch has done, kept beside its results, so that it can go on where it stopped."""

import hashlib
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..crew.stamp import Stamp
from ..errors import CrfDeblurError
from ..io import to_record, write_text
from ..io.inputs import read_bytes
from ..io.json_files import parse_json
from ..io.limits import LIMITS, Limits
from ..texts import brief

NAME = "crfdeblur-batch.jsonl"
FORMAT, VERSION = "crfdeblur-batch", 1


def fingerprint(settings: object) -> str:
    """Text that is the same for equal settings: methods, curves, PSFs, numbers in a dict."""
    text = json.dumps(to_record(settings), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


@dataclass(slots=True, eq=False)
class Journal:
    """The journal of a folder: a line of JSON for everything that was done; the last one counts.

    A line that was cut off when the batch was killed is left out; what it would have said is
    done again.

    Parameters
    ----------
    folder : Path
        Of the results.
    owners : dict
        Photos, by the names of their results.
    done : dict
        What each result was made of and by, by its name.
    shared : dict
        What response and PSF were found from, by ``"response"`` and ``"psf"``.
    """

    folder: Path
    owners: dict[str, str]
    done: dict[str, dict[str, Any]]
    shared: dict[str, dict[str, Any]]

    @classmethod
    def of(cls, folder: Path, *, limits: Limits = LIMITS) -> "Journal":
        """The journal of a folder, empty if it has none; cleared of what is out of date.

        Parameters
        ----------
        folder : Path
        limits : Limits, optional
            For the size of the journal.

        Raises
        ------
        CrfDeblurError
            Of another version, or no journal.
        """
        journal = cls(folder, {}, {}, {})
        path = folder / NAME
        if path.exists():
            lines = read_bytes(path, limits.journal).splitlines()
            _check(path, lines[:1])
            for line in lines[1:]:
                journal._take(_entry(line))
        write_text(path, "".join(f"{json.dumps(each)}\n" for each in journal._entries()))
        return journal

    def claim(self, photo: Path, suffix: str, ending: str) -> str:
        """Name of the result of a photo: its own from before, or one that nobody has."""
        pattern = re.compile(rf"{re.escape(photo.stem + suffix)}(-\d+)?{re.escape(ending)}")
        for name, owner in self.owners.items():
            if owner == str(photo) and pattern.fullmatch(name):
                return name
        taken = {name.casefold() for name in self.owners}
        number, name = 1, f"{photo.stem}{suffix}{ending}"
        while name.casefold() in taken or (self.folder / name).exists():
            number += 1
            name = f"{photo.stem}{suffix}-{number}{ending}"
        self._write({"kind": "claim", "photo": str(photo), "result": name})
        return name

    def is_done(self, name: str, photo: Stamp, settings: str) -> bool:
        """Whether a result is there, of this photo as it is now, and by these settings."""
        entry = self.done.get(name)
        if entry is None or entry["settings"] != settings or entry["photo"] != _facts(photo):
            return False
        path = self.folder / name
        return path.exists() and _facts(Stamp.of(path)) == entry["result"]

    def finish(self, name: str, photo: Stamp, settings: str) -> None:
        """Note that a result is there."""
        result = _facts(Stamp.of(self.folder / name))
        facts = {"photo": _facts(photo), "settings": settings, "result": result}
        self._write({"kind": "done", "name": name, **facts})

    def found(self, what: str, settings: str, photos: list[Path]) -> bool:
        """Whether response or PSF were found, in this way, from these photos and maybe others."""
        entry = self.shared.get(what)
        return (
            entry is not None
            and entry["settings"] == settings
            and {str(photo) for photo in photos} <= set(entry["photos"])
        )

    def keep(self, what: str, settings: str, photos: list[Path]) -> None:
        """Note what response or PSF were found from."""
        names = [str(photo) for photo in photos]
        self._write({"kind": what, "settings": settings, "photos": names})

    def _take(self, entry: dict[str, Any]) -> None:
        match entry:
            case {"kind": "claim", "photo": str(photo), "result": str(name)}:
                self.owners[name] = photo
            case {"kind": "done", "name": str(name), "photo": _, "settings": _, "result": _}:
                self.done[name] = entry
            case {"kind": "response" | "psf" as what, "settings": _, "photos": list(photos)}:
                if all(isinstance(photo, str) for photo in photos):
                    self.shared[what] = entry

    def _entries(self) -> list[dict[str, Any]]:
        claims = [
            {"kind": "claim", "photo": photo, "result": name} for name, photo in self.owners.items()
        ]
        first = {"format": FORMAT, "version": VERSION}
        return [first, *claims, *self.done.values(), *self.shared.values()]

    def _write(self, entry: dict[str, Any]) -> None:
        self._take(entry)
        path = self.folder / NAME
        try:
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(entry) + "\n")
        except OSError as error:
            raise CrfDeblurError(
                f"{path}: cannot be written ({error.strerror}); make room, and start the batch "
                "again, which keeps what is done"
            ) from error


def _facts(stamp: Stamp) -> list[int]:
    return [stamp.size, stamp.changed]


def _entry(line: bytes) -> dict[str, Any]:
    try:
        entry = parse_json(line)
    except ValueError:
        return {}
    return entry if isinstance(entry, dict) else {}


def _check(path: Path, first: list[bytes]) -> None:
    head = _entry(first[0]) if first else {}
    if head.get("format") != FORMAT:
        raise CrfDeblurError(
            f"{path}: is no journal of a batch; take it away, or choose another folder"
        )
    if head.get("version") != VERSION:
        raise CrfDeblurError(
            f"{path}: journals of version {brief(head.get('version'))} are not known; "
            "update napari-crfdeblur, or choose another folder"
        )
