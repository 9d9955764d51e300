"""``crfdeblur deblur`` for photos and stacks that are too large to be worked on as a whole."""

from argparse import Namespace
from dataclasses import replace
from pathlib import Path

from ..crew.stamp import check_zarr
from ..errors import CrfDeblurError, about
from ..io.images import TIFF
from ..large import Source, check_target, open_source, storing
from ..large.deblur import FoundInPart, deblurring_large, is_volume
from ..large.region import read_part
from ..large.sources import NPY, ZARR
from ..large.tiff import size_of_page
from ..pipeline import DeblurOptions
from ..pipeline.intermediates import PLANE, made
from ..psf import PsfEstimate
from ..report import Report
from ..texts import printable
from .bar import run
from .files import file_beside

PIXELS = 1 << 26  # above which a photo is worked on in tiles
ENDINGS = (*TIFF, ZARR)


def wants_tiles(arguments: Namespace, options: DeblurOptions) -> bool:
    """Whether a photo is worked on in tiles: asked for, the only way, or better for its size."""
    path, output = arguments.photo, arguments.output
    ending = output.suffix.lower() if output else ".tif"
    if arguments.tiled or arguments.scheduler or ending == ZARR or is_volume(options):
        return True
    if path.is_dir() or path.suffix.lower() == NPY:
        return True
    whole = arguments.edges or arguments.save_edges or arguments.cameras or ending not in ENDINGS
    large = not whole and path.suffix.lower() in TIFF and path.is_file()
    return large and size_of_page(path) > PIXELS


def default_output(photo: Path) -> Path:
    """Beside the photo: zarr for zarr, else TIFF."""
    ending = ZARR if photo.is_dir() else ".tif"
    return file_beside(photo, f"{photo.stem}-deblurred{ending}")


def check_large(arguments: Namespace, output: Path, options: DeblurOptions) -> None:
    """Refuse, before any work, what cannot be done in tiles."""
    check_place(arguments.photo, output)
    if arguments.varying and is_volume(options):
        raise CrfDeblurError("--varying is for PSFs with rows and columns only: leave it out")
    if arguments.edges or arguments.save_edges:
        raise CrfDeblurError(
            "--edges and --save-edges are for photos that are worked on as a whole; find the "
            "response on one of those, and give it with --response"
        )
    if arguments.cameras or arguments.camera:
        raise CrfDeblurError(
            "--cameras is for photos that are worked on as a whole; estimate the response first, "
            "and give it with --response"
        )


def check_place(photo: Path, output: Path) -> None:
    """Refuse what is no photo for tiles, and a result that tiles cannot be written to."""
    if photo.is_dir():
        check_zarr(photo)
    if output.suffix.lower() not in ENDINGS:
        raise CrfDeblurError(
            f"{output}: a photo in tiles is written as TIFF or zarr; choose a name that ends in "
            + ", ".join(ENDINGS)
        )
    check_target(output)


def deblur_in_tiles(
    photo: Path, source: Source, output: Path, options: DeblurOptions, scheduler: str | None
) -> FoundInPart:
    """Find response and PSF on a part of the photo, and restore all of it in tiles.

    Parameters
    ----------
    photo : Path
        For messages.
    source : Source
        The photo.
    output : Path
        Where the result is written.
    options : DeblurOptions
    scheduler : str or None
        Address of a cluster.
    """
    try:
        found = run(deblurring_large(source, options))
    except CrfDeblurError as error:
        raise about(photo, error) from error
    run(storing(found.lazy, output, scheduler=scheduler, source=source))
    return found


def report_of_tiles(photo: Path, source: Source, found: FoundInPart, output: Path | None) -> Report:
    """What was found in the part, and the part restored, if `output` has it."""
    have = found.have
    return Report(
        title=f"{printable(photo.name)}, {_place(source, found.region)}",
        photo=have.photo,
        edges=have.edges or (),
        groups=have.groups or (),
        responses=made(have.response, "a response").estimates,
        psf=_seen(made(have.psf, "a PSF")),
        field=have.field,
        sharp=read_part(open_source(output), found.region) if output else None,
    )


def _seen(found: PsfEstimate) -> PsfEstimate:
    """A PSF as a picture: that of volumes as it is seen along the first axis."""
    return found if found.psf.ndim == PLANE else replace(found, psf=found.psf.sum(axis=0))


def _place(source: Source, region: tuple[slice, ...]) -> str:
    axes = 3 if source.color else 2
    names = [f"slice {part.start}" for part in region[:-axes]]
    sides = zip(("rows", "columns"), region[-axes:][:2], strict=True)
    return ", ".join([*names, *(f"{name} {s.start} to {s.stop}" for name, s in sides)])
