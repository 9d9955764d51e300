"""What is known of each camera from its photos, kept in a folder from one photo to the next."""

import hashlib
import json
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from .._typing import Image
from .._version import __version__
from ..errors import DAMAGED, CrfDeblurError
from ..photo import little_endian
from ..response import ResponsePrior
from ..texts import brief
from .camera_keys import CameraKey
from .files import check_folder, write_text
from .inputs import is_folder
from .json_files import read_json
from .limits import LIMITS, Limits
from .records import from_record, to_record

FORMAT, VERSION = "crfdeblur-camera", 1


@dataclass(frozen=True, slots=True)
class CountedPhoto:
    """A photo that an estimate rests on.

    Parameters
    ----------
    name : str
        Of its file.
    digest : str
        SHA-256 of its pixels: the same picture under another name, or with other camera data,
        is the same photo.
    """

    name: str
    digest: str

    @classmethod
    def of(cls, name: str, photo: Image) -> "CountedPhoto":
        """The entry of a photo as it was read, shape (M, N), (M, N, 3) or (M, N, 4)."""
        kind = photo.dtype.newbyteorder("<").str
        digest = hashlib.sha256(f"{kind} {photo.shape} ".encode())
        digest.update(little_endian(photo))
        return cls(name, digest.hexdigest())


@dataclass(frozen=True, slots=True, eq=False)
class CameraRecord:
    """What the photos of one camera have told of its response.

    Parameters
    ----------
    key : CameraKey
        Which camera, and how it rendered the photos.
    posterior : ResponsePrior
        What is known of its response: the prior for its next photo.
    photos : tuple of CountedPhoto
        On which that rests, at least one, none twice.
    """

    key: CameraKey
    posterior: ResponsePrior
    photos: tuple[CountedPhoto, ...]

    def __post_init__(self) -> None:
        digests = {photo.digest for photo in self.photos}
        if not self.photos or len(digests) < len(self.photos):
            raise ValueError(f"expected at least one photo, none twice, got {len(self.photos)}")

    def counts(self, photo: CountedPhoto) -> bool:
        """Whether it rests on a photo already, whatever its name."""
        return any(photo.digest == known.digest for known in self.photos)


def camera_file(folder: Path, key: CameraKey) -> Path:
    """Where a camera is kept, whether there is anything yet or not."""
    return folder / key.file_name


def write_camera(folder: Path, record: CameraRecord) -> None:
    """Write what is known of a camera, whole or not at all, in the place of what was known.

    Parameters
    ----------
    folder : Path
        In which every camera has a file of its own, :func:`camera_file`.
    record : CameraRecord
    """
    check_folder(folder)
    content = {
        "format": FORMAT,
        "version": VERSION,
        "software": f"napari-crfdeblur {__version__}",
        "camera": asdict(record.key),
        "photos": [asdict(photo) for photo in record.photos],
        "posterior": to_record(record.posterior),
    }
    write_text(camera_file(folder, record.key), json.dumps(content, indent=1) + "\n")


def read_camera(folder: Path, key: CameraKey, *, limits: Limits = LIMITS) -> CameraRecord | None:
    """Read what is known of a camera; None if there is nothing yet.

    Parameters
    ----------
    folder : Path
    key : CameraKey
    limits : Limits, optional
        For the size of the file.

    Raises
    ------
    CrfDeblurError
        There is no such folder; the file is damaged, of another camera, or of a newer version.
    """
    _check_there(folder)
    path = camera_file(folder, key)
    if not path.exists():
        return None
    record = _read(path, limits)
    if record.key != key:
        raise CrfDeblurError(
            f"{path}: is of another camera, {record.key}; delete it, or put the file back under "
            f"its own name, {record.key.file_name}"
        )
    return record


def stored_cameras(folder: Path) -> tuple[CameraRecord, ...]:
    """All cameras of a folder, by their names.

    A file that is none, is damaged, or lies under another name than its own is passed over.

    Raises
    ------
    CrfDeblurError
        There is no such folder.
    """
    _check_there(folder)
    found = []
    for path in folder.glob("*.json"):
        with suppress(CrfDeblurError):
            record = _read(path, LIMITS)
            if record.key.file_name == path.name:
                found.append(record)
    return tuple(sorted(found, key=lambda record: str(record.key)))


def _check_there(folder: Path) -> None:
    if not is_folder(folder):
        raise CrfDeblurError(f"{folder}: there is no such folder; give the one with the cameras")


def _read(path: Path, limits: Limits) -> CameraRecord:
    content = read_json(path, limits=limits)
    try:
        version = _version(content)
        if version > VERSION:
            raise CrfDeblurError(
                f"{path}: stored cameras of version {version} are not known; "
                "update napari-crfdeblur"
            )
        return _record(content)
    except DAMAGED as error:
        raise CrfDeblurError(
            f"{path}: not a stored camera, or damaged ({brief(error)}); delete it, and estimate "
            "the photos of the camera again"
        ) from error


def _version(content: Any) -> int:
    if content["format"] != FORMAT:
        raise ValueError(f'"format" is not "{FORMAT}"')
    version = content["version"]
    if not isinstance(version, int) or version < 1:
        raise ValueError(f"there is no version {version}")
    return version


def _record(content: dict[str, Any]) -> CameraRecord:
    entries = content["camera"], *content["photos"]
    if not all(isinstance(text, str) for entry in entries for text in entry.values()):
        raise ValueError("a name is not a text")
    try:
        posterior = from_record(content["posterior"])
    except CrfDeblurError as error:
        raise ValueError(str(error)) from error
    if not isinstance(posterior, ResponsePrior):
        raise ValueError("its posterior is not a family of responses")
    camera, *photos = entries
    counted = tuple(CountedPhoto(**photo) for photo in photos)
    return CameraRecord(CameraKey(**camera), posterior, counted)
