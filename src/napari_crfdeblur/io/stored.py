"""The camera of some photos with what is stored of it: none of them counts twice."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from ..errors import CrfDeblurError
from ..estimate import (
    Finding,
    GivenResponse,
    MaximumLikelihood,
    ResponseEstimate,
    ResponseStatus,
)
from ..estimate.band import TWO_SIDED_95
from ..response import ResponsePrior
from .camera_keys import CameraKey
from .cameras import CameraRecord, CountedPhoto, camera_file, read_camera, write_camera

Fits = TypeVar("Fits")  # methods of all channels, or of each

# What a status means where a stored camera was the start or all there is.
STORED = {
    ResponseStatus.GIVEN: "this is the stored estimate",
    ResponseStatus.CANNOT_TELL: "this is the stored estimate, to which the edges add too little",
}
# Why an estimate is not kept, though it is shown.
REFUSED = {
    ResponseStatus.CANNOT_TELL: "the edges add too little to what was assumed",
    ResponseStatus.NOT_CONVERGED: "the search for the response did not converge",
    Finding.CONTRADICTION: "the photos contradict each other or what is stored",
}


@dataclass(frozen=True, slots=True, eq=False)
class StoredCamera:
    """The camera of some photos, with what is stored of it.

    Parameters
    ----------
    folder : Path
        Of all stored cameras.
    key : CameraKey
    record : CameraRecord, optional
        What is known of it, if anything is.
    photos : tuple of CountedPhoto
        Those that were given, counted already or not.
    """

    folder: Path
    key: CameraKey
    record: CameraRecord | None
    photos: tuple[CountedPhoto, ...]

    @property
    def fresh(self) -> tuple[int, ...]:
        """Numbers of the photos that are not counted yet."""
        return tuple(
            index
            for index in self.distinct
            if not (self.record and self.record.counts(self.photos[index]))
        )

    @property
    def distinct(self) -> tuple[int, ...]:
        """Numbers of the photos, of equal ones the first."""
        digests = [photo.digest for photo in self.photos]
        return tuple(i for i, digest in enumerate(digests) if digests.index(digest) == i)

    @property
    def used(self) -> tuple[int, ...]:
        """Numbers of the photos to be looked at: the fresh ones, or, if there are none, all."""
        return self.fresh or self.distinct

    def method(self, fits: Fits) -> Fits | MaximumLikelihood | GivenResponse:
        """Estimation from what is stored; if that rests on all photos already, it as it is."""
        if self.record is None or not isinstance(fits, MaximumLikelihood):
            return fits
        if not self.fresh:
            return GivenResponse(self.record.posterior.curve())
        return replace(fits, prior=self.record.posterior)

    def told(self, found: tuple[ResponseEstimate, ...]) -> tuple[ResponseEstimate, ...]:
        """The estimates; a stored one as it is with the band of what is known of it."""
        if self.record is None or self.fresh:
            return found
        return tuple(_with_band(each, self.record.posterior) for each in found)

    def verdict(self, found: ResponseEstimate) -> str:
        """How far an estimate can be trusted, in words; what was assumed is this camera."""
        if self.record is None or found.status not in STORED:
            return found.status.value
        return STORED[found.status]

    def sentences(self) -> list[str]:
        """Which camera it is, what is assumed of it, and which photos are left out."""
        known = "nothing is stored of it yet"
        if self.record:
            known = f"starting from its stored estimate, from {_count(self.record)}"
        left = [self.photos[i].name for i in range(len(self.photos)) if i not in self.fresh]
        if not left:
            return [f"camera: {self.key}", known]
        what = "left out" if self.fresh else "so the stored estimate is used as it is"
        return [f"camera: {self.key}", known, f"{', '.join(left)}: counted already, {what}"]


def _with_band(found: ResponseEstimate, known: ResponsePrior) -> ResponseEstimate:
    irradiance = found.curve.to_irradiance(found.intensity)
    width = TWO_SIDED_95 * known.deviation(irradiance) / found.curve.slope(irradiance)
    lower, upper = (irradiance - width).clip(0, 1), (irradiance + width).clip(0, 1)
    return replace(found, lower=lower, upper=upper, posterior=known)


def keep_estimate(camera: StoredCamera, found: ResponseEstimate, folder: Path | None = None) -> str:
    """Store what is known of a camera after its new photos; the sentence that says so.

    Parameters
    ----------
    camera : StoredCamera
    found : ResponseEstimate
    folder : Path, optional
        Where the file is written, if it is put in its place later; by default in its place.
    """
    before = _count(camera.record) if camera.record else "nothing"
    if not camera.fresh:
        return f"stored of this camera: {before}, as before"
    reasons = [REFUSED[each] for each in (found.status, *found.findings) if each in REFUSED]
    if reasons or found.posterior is None:
        reason = "; ".join(reasons) or "nothing is known of its spread"
        return f"not stored: {reason}; stored of this camera: {before}, as before"
    _check_unchanged(camera)
    counted = camera.record.photos if camera.record else ()
    photos = (*counted, *(camera.photos[index] for index in camera.fresh))
    record = CameraRecord(camera.key, found.posterior, photos)
    write_camera(folder or camera.folder, record)
    path = camera_file(camera.folder, camera.key)
    return f"stored of this camera: {_count(record)} now, in {path}"


def _check_unchanged(camera: StoredCamera) -> None:
    """Refuse to undo what another run has stored meanwhile."""
    now = read_camera(camera.folder, camera.key)
    if (now and now.photos) != (camera.record and camera.record.photos):
        raise CrfDeblurError(
            f"{camera_file(camera.folder, camera.key)}: was changed while the photos were "
            "estimated; start again"
        )


def _count(record: CameraRecord) -> str:
    count = len(record.photos)
    return f"{count} photo{'s' * (count != 1)}"
