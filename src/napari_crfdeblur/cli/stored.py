"""Cameras kept from one photo to the next: ``--cameras`` and ``--camera``."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from .._typing import Image
from ..errors import CrfDeblurError
from ..io import CameraKey, CountedPhoto, StoredCamera, read_camera, read_camera_key


def check_cameras(arguments: Namespace) -> None:
    """Refuse options that do not go together, before any work."""
    if arguments.cameras is None:
        if arguments.camera is not None:
            raise CrfDeblurError("--camera names a camera that is stored: give --cameras FOLDER")
        return
    if arguments.per_channel:
        raise CrfDeblurError(
            "--cameras keeps one response for all channels: leave out --per-channel"
        )
    if getattr(arguments, "response", "auto") != "auto":
        raise CrfDeblurError("--cameras is for a response that is estimated: leave out --response")
    if arguments.command == "estimate" and arguments.method != "likelihood":
        raise CrfDeblurError(
            f"--cameras is for --method likelihood: {arguments.method} cannot start from what is "
            "known of a camera"
        )


def stored_camera(
    arguments: Namespace, paths: Sequence[Path], photos: Sequence[Image]
) -> StoredCamera | None:
    """The camera that took the photos, with what is stored; None without ``--cameras``."""
    if arguments.cameras is None:
        return None
    key = _key(paths, arguments.camera)
    counted = [CountedPhoto.of(p.name, photo) for p, photo in zip(paths, photos, strict=True)]
    record = read_camera(arguments.cameras, key)
    return StoredCamera(arguments.cameras, key, record, tuple(counted))


def _key(paths: Sequence[Path], name: str | None) -> CameraKey:
    """The one camera of all photos, as their EXIF data or the user say."""
    keys = [read_camera_key(path) for path in paths]
    stated = sorted({str(key) if name is None else key.name for key in keys if key})
    if len(stated) > 1:
        raise CrfDeblurError(
            f"the photos are of different cameras or settings: {'; '.join(stated)}. Their "
            "responses differ: give the photos of one at a time"
        )
    if name is not None:
        return CameraKey("", name)
    own = [_own(path, key) for path, key in zip(paths, keys, strict=True)]
    return own[0]


def _own(path: Path, key: CameraKey | None) -> CameraKey:
    """The key of a photo that tells of its camera's response."""
    if key is None:
        raise CrfDeblurError(
            f"{path}: does not say which camera took it; name it with --camera NAME"
        )
    if key.edited:
        raise CrfDeblurError(
            f"{path}: {key.edited}, so that its tones may not be those of the camera; give the "
            "file of the camera, or --camera NAME for photos that were edited alike"
        )
    return key
