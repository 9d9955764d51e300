"""``crfdeblur deblur`` for photos and stacks that are too large to be worked on as a whole."""

from argparse import Namespace
from dataclasses import replace
from pathlib import Path

from ..errors import CrfDeblurError
from ..io.images import TIFF
from ..large import Source, check_target, informative_region, open_source, restore_large, storing
from ..large.region import read_part
from ..large.restore import check_blur
from ..large.sources import NPY, ZARR
from ..large.stamp import check_zarr
from ..large.tiff import size_of_page
from ..photo import check_photo
from ..pipeline import (
    DEFAULT_METHOD,
    DeblurOptions,
    FoundBlur,
    edges_needed,
    finding_blur,
    joint_curve,
)
from ..psf import GivenPsf, PsfEstimate
from ..report import Report
from ..texts import printable
from .bar import run
from .files import beside
from .limits import check_fits

PLANE = 2  # axes
PIXELS = 1 << 26  # above which a photo is worked on in tiles
GIVEN = 1024  # side of the part that is looked at if response and PSF are given
ENDINGS = (*TIFF, ZARR)


def wants_tiles(arguments: Namespace, options: DeblurOptions) -> bool:
    """Whether a photo is worked on in tiles: asked for, the only way, or better for its size."""
    path, output = arguments.photo, arguments.output
    ending = output.suffix.lower() if output else ".tif"
    if arguments.tiled or arguments.scheduler or ending == ZARR or _is_volume(options):
        return True
    if path.is_dir() or path.suffix.lower() == NPY:
        return True
    whole = arguments.edges or arguments.save_edges or arguments.cameras or ending not in ENDINGS
    large = not whole and path.suffix.lower() in TIFF and path.is_file()
    return large and size_of_page(path) > PIXELS


def default_output(photo: Path) -> Path:
    """Beside the photo: zarr for zarr, else TIFF."""
    ending = ZARR if photo.is_dir() else ".tif"
    return beside(photo, f"{photo.stem}-deblurred{ending}")


def check_large(arguments: Namespace, output: Path, options: DeblurOptions) -> None:
    """Refuse, before any work, what cannot be done in tiles."""
    if arguments.photo.is_dir():
        check_zarr(arguments.photo)
    if output.suffix.lower() not in ENDINGS:
        raise CrfDeblurError(
            f"{output}: a photo in tiles is written as TIFF or zarr; choose a name that ends in "
            + ", ".join(ENDINGS)
        )
    if arguments.varying and _is_volume(options):
        raise CrfDeblurError("--varying is for PSFs with rows and columns only: leave it out")
    if arguments.edges or arguments.save_edges:
        raise CrfDeblurError(
            "--edges and --save-edges are for photos that are worked on as a whole; find the "
            "response on one of those, and give it with --response"
        )
    check_target(output)


def deblur_in_tiles(
    arguments: Namespace, output: Path, options: DeblurOptions
) -> tuple[FoundBlur, Report]:
    """Find response and PSF on a part of the photo, and restore all of it in tiles.

    Parameters
    ----------
    arguments : Namespace
    output : Path
        Where the result is written.
    options : DeblurOptions
    """
    source = open_source(arguments.photo)
    if isinstance(options.psf, GivenPsf):
        check_blur(source, options.psf.psf, source.color)
    check_fits(arguments, arguments.photo, _plane(source))
    region = informative_region(source, *_sides(source, options))
    part = read_part(source, region)
    try:
        check_photo(part)
    except CrfDeblurError as error:
        raise CrfDeblurError(f"{arguments.photo}: {error}") from error
    found = run(finding_blur(part, options))
    curve = joint_curve(found.responses)
    method = options.method or DEFAULT_METHOD
    blur = found.field or found.psf.psf
    array = restore_large(source, curve, blur, method, channels=source.color)
    run(storing(array, output, scheduler=arguments.scheduler, source=source))
    report = Report(
        title=f"{printable(arguments.photo.name)}, {_place(source, region)}",
        photo=part,
        edges=found.edges,
        groups=found.groups,
        responses=found.responses,
        psf=_seen(found.psf),
        field=found.field,
        sharp=read_part(open_source(output), region) if arguments.report else None,
    )
    return found, report


def _sides(source: Source, options: DeblurOptions) -> tuple[int, ...]:
    """Rows and columns of the part that is looked at; all of them if the blur varies."""
    if options.regions is not None:
        return _plane(source)
    return () if edges_needed(options) else (GIVEN, GIVEN)


def _plane(source: Source) -> tuple[int, int]:
    """Rows and columns."""
    rows, columns = source.shape[: len(source.shape) - source.color][-2:]
    return rows, columns


def _is_volume(options: DeblurOptions) -> bool:
    """Whether the PSF has three dimensions, so that a stack is worked on as a volume."""
    return isinstance(options.psf, GivenPsf) and options.psf.psf.ndim > PLANE


def _seen(found: PsfEstimate) -> PsfEstimate:
    """A PSF as a picture: that of volumes as it is seen along the first axis."""
    return found if found.psf.ndim == PLANE else replace(found, psf=found.psf.sum(axis=0))


def _place(source: Source, region: tuple[slice, ...]) -> str:
    axes = 3 if source.color else 2
    names = [f"slice {part.start}" for part in region[:-axes]]
    sides = zip(("rows", "columns"), region[-axes:][:2], strict=True)
    return ", ".join([*names, *(f"{name} {s.start} to {s.stop}" for name, s in sides)])
