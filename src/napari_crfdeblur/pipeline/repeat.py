"""Doing again what a record says, on the same photo or on another one."""

from dataclasses import dataclass

from ..deconvolution.tiles import Region
from ..errors import CrfDeblurError
from ..progress import Job
from .intermediates import Intermediates, made
from .path import Stage, walking
from .record import Pixels, Record, identifying, result_of, versions
from .stack import PhotoStack, Restored, restoring_stack

RESTORING = (Stage.LINEAR, Stage.RESTORE, Stage.REAPPLY)


@dataclass(frozen=True, slots=True, eq=False)
class Repeated:
    """What came out the second time.

    Parameters
    ----------
    record : Record
        Of the first time.
    found : Intermediates
        What was found in the slice of the record, as far as that went.
    restored : Restored
        The region of the record; empty if it only found something.
    photo, result : Pixels
        What went in now, and what came out, if anything did.
    """

    record: Record
    found: Intermediates
    restored: Restored
    photo: Pixels
    result: Pixels | None

    @property
    def same_photo(self) -> bool:
        """Whether the photo has the pixels of the record's."""
        return self.photo.same_as(self.record.photo)

    @property
    def same_result(self) -> bool | None:
        """Whether the result has the pixels of the record's; None if there is none to compare."""
        if self.result is None or self.record.result is None or not self.same_photo:
            return None
        return self.result.same_as(self.record.result)

    @property
    def sentences(self) -> list[str]:
        """Whether the same came out, and if not, why, for the user."""
        return told(self.record, self.photo, self.same_result)


def told(record: Record, photo: Pixels, same: bool | None) -> list[str]:
    """Whether the same came out as a record says, and if not, why it may be."""
    now, said = versions(), []
    if not photo.same_as(record.photo):
        said.append(f"this is another photo than that of the record, {record.photo.name}")
    said += [
        f"the record was made with {name} {old}, and this with {now[name]}"
        for name, old in record.versions.items()
        if name in now and now[name] != old
    ]
    if same is None:
        return said
    return [*said, f"the result {'is the same' if same else 'differs'}, pixel by pixel"]


def repeating(record: Record, stack: PhotoStack) -> Job[Repeated]:
    """Long job: do again what a record says.

    Parameters
    ----------
    record : Record
    stack : PhotoStack
        The same photo, or another one, on which the same is done.

    Raises
    ------
    CrfDeblurError
        The photo lacks what the record speaks of, it was made in tiles, or a stage is not
        possible.
    """
    if record.tiled:
        raise CrfDeblurError(
            "this was done in tiles: repeat it with the command `crfdeblur repeat`, into a file"
        )
    record.check_fits(stack)
    photo = yield from identifying(stack)
    plane, region = places(record, stack)
    stages = list(Stage)
    last = min(record.until, Stage.FIELD, key=stages.index)
    found = yield from walking(Intermediates(stack.photo(plane)), record.options, until=last)
    if record.until not in RESTORING:
        return Repeated(record, found, Restored(), photo, None)
    psf = made(found.psf, "a PSF").psf if record.until is not Stage.LINEAR else None
    blur = found.field if found.field is not None else psf
    response = made(found.response, "a response")
    restored = yield from restoring_stack(
        stack, region, response, blur, record.options, until=record.until
    )
    return Repeated(record, found, restored, photo, result_of(stack, restored))


def places(record: Record, stack: PhotoStack) -> tuple[Region, Region]:
    """The slice in which a record finds response and PSF, and the region that it restores."""
    index = record.plane or (0,) * (len(stack.shape) - 2)
    plane = (*(slice(i, i + 1) for i in index), *stack.whole[-2:])
    spans = record.region
    return plane, stack.whole if spans is None else tuple(slice(*span) for span in spans)
