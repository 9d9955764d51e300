"""Stored cameras of a session: what is kept in a folder, and which camera took the photo."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from napari.layers import Image as ImageLayer

from .._typing import Image
from ..deconvolution.tiles import Region
from ..errors import CrfDeblurError
from ..estimate import MaximumLikelihood, ResponseFit
from ..estimate.likelihood import LiveFit
from ..io import (
    CameraKey,
    CameraRecord,
    CountedPhoto,
    StoredCamera,
    read_camera_key,
    read_photo,
    stored_cameras,
)
from ..pipeline import PhotoStack
from ..progress import Job, Progress
from ..response import ResponsePrior
from .session.state import Fitted

UNKNOWN = "this photo does not say which camera took it: choose one, or name it when you keep it"


@dataclass(frozen=True, slots=True, eq=False)
class CameraFolder:
    """The cameras of a folder, beside the photo at work.

    Parameters
    ----------
    folder : Path
        Of all stored cameras.
    records : tuple of CameraRecord
        What is stored of each.
    own : CameraKey or None
        The camera of the photo, as its file says.
    photo : CountedPhoto
        The photo.
    """

    folder: Path
    records: tuple[CameraRecord, ...]
    own: CameraKey | None
    photo: CountedPhoto

    @property
    def trusted(self) -> CameraKey | None:
        """The camera of the photo, unless a program has changed its tones since."""
        return None if self.own is None or self.own.edited else self.own

    def stored(self, key: CameraKey) -> StoredCamera:
        """A camera with the photo at work."""
        record = next((record for record in self.records if record.key == key), None)
        return StoredCamera(self.folder, key, record, (self.photo,))

    def knows(self, key: CameraKey | None) -> bool:
        """Whether something is stored of a camera."""
        return any(record.key == key for record in self.records)

    def method(self, key: CameraKey, method: MaximumLikelihood) -> ResponseFit:
        """Estimation from what is stored, or that as it is if the photo is counted in it.

        Raises
        ------
        CrfDeblurError
            Nothing is stored of the camera any more.
        """
        if not self.knows(key):
            raise CrfDeblurError(f"nothing is stored of {key} any more: choose another camera")
        return self.stored(key).method(method)

    def told(self, chosen: CameraKey | None) -> str:
        """Which camera it is, and what is stored of it, for the user."""
        key = chosen or self.own
        if key is None:
            return UNKNOWN
        if chosen is None and key.edited:
            return f"{key}: its tones may not be those of the camera; choose a camera yourself"
        if chosen is None and self.knows(key):
            return f"camera: {key}; choose it to start from what is stored of it"
        return "; ".join(self.stored(key).sentences())


def looking_up(
    source: PhotoStack, plane: Region, path: Path | None, folder: Path
) -> Job[CameraFolder]:
    """Long job: the cameras of a folder, and the one that took the photo.

    Raises
    ------
    CrfDeblurError
        There is no such folder, or the file of the photo cannot be read any more.
    """
    yield Progress("stored cameras", 0, 2)
    records = stored_cameras(folder)
    own = read_camera_key(path) if path else None
    yield Progress("the camera of the photo", 1, 2)
    photo = CountedPhoto.of(path.name if path else source.name, _pixels(source, plane, path))
    return CameraFolder(folder, records, own, photo)


def picture_file_of(photo: ImageLayer) -> Path | None:
    """The picture file that a layer was opened from, if it was and the file is there."""
    path = photo.source.path
    return Path(path) if path and Path(path).is_file() else None


def check_kept(fitted: Fitted, camera: StoredCamera) -> None:
    """Refuse to store an estimate that does not rest on what is stored and this photo alone.

    Raises
    ------
    CrfDeblurError
        The message says what to do.
    """
    if not camera.fresh:
        return  # nothing will be stored
    if len(fitted.estimates) != 1:
        raise CrfDeblurError(
            "one response is stored for all channels: estimate without one curve per channel"
        )
    fit = next(iter(fitted.responses.fits), None)
    if not isinstance(fit, LiveFit):
        raise CrfDeblurError("only an estimate of maximum likelihood is stored: estimate first")
    if any(group.sources[0].image for group in fitted.groups):
        raise CrfDeblurError(
            "this estimate rests on further photos, too: estimate and keep them one by one"
        )
    if fit.found is None:
        raise CrfDeblurError("no edge of this photo tells of its camera: draw one, and estimate")
    prior = fit.found.problem.prior
    if camera.record is None and fit.seen:
        raise CrfDeblurError(
            f"this estimate started from another response: choose a kind of camera, since nothing "
            f"is stored of {camera.key} yet, and estimate again"
        )
    if camera.record is not None and not _same(prior, camera.record.posterior):
        raise CrfDeblurError(
            f"this estimate did not start from what is stored of {camera.key}: choose it under "
            "camera, and estimate again"
        )


def _same(one: ResponsePrior, other: ResponsePrior) -> bool:
    return np.array_equal(one.mean, other.mean) and np.array_equal(one.directions, other.directions)


def _pixels(source: PhotoStack, plane: Region, path: Path | None) -> Image:
    """The photo as its file has it, as for the command line; that of the layer without a file."""
    if path is not None:
        try:
            photo = read_photo(path)
        except CrfDeblurError:  # of a kind that only napari reads
            return source.photo(plane)
        if photo.shape[:2] == source.shape:
            return photo
    return source.photo(plane)
