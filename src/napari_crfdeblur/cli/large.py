"""``crfdeblur deblur`` for photos and stacks that are too large to be worked on as a whole."""

from argparse import Namespace
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import CrfDeblurError
from ..io.images import TIFF
from ..large import Source, check_target, informative_region, open_source, restore_large, storing
from ..large.region import read_part
from ..large.restore import check_blur
from ..large.sources import NPY, ZARR
from ..large.tiff import size_of_page
from ..pipeline import (
    DEFAULT_METHOD,
    DeblurOptions,
    Intermediates,
    Stage,
    edges_needed,
    walking,
)
from ..pipeline.intermediates import made
from ..psf import GivenPsf, PsfEstimate
from ..report import Report
from .bar import run

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
    return not whole and path.suffix.lower() in TIFF and size_of_page(path) > PIXELS


def default_output(photo: Path) -> Path:
    """Beside the photo: zarr for zarr, else TIFF."""
    ending = ZARR if photo.is_dir() else ".tif"
    return photo.with_name(f"{photo.stem}-deblurred{ending}")


def check_large(arguments: Namespace, output: Path, options: DeblurOptions) -> None:
    """Refuse, before any work, what cannot be done in tiles."""
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
    if output.exists() and arguments.photo.exists() and output.samefile(arguments.photo):
        raise CrfDeblurError(f"{output}: is the photo itself; choose another name")
    check_target(output)


def deblur_in_tiles(arguments: Namespace, output: Path, options: DeblurOptions) -> Report:
    """Find response and PSF on a part of the photo, and restore all of it in tiles."""
    source = open_source(arguments.photo)
    if isinstance(options.psf, GivenPsf):
        check_blur(source, options.psf.psf, source.color)
    region = informative_region(source, *_sides(source, options))
    have = Intermediates(read_part(source, region))
    try:
        have = run(walking(have, options, until=Stage.FIELD))
    except CrfDeblurError as error:
        raise CrfDeblurError(f"{arguments.photo}: {error}") from error
    response, psf = made(have.response, "a response"), made(have.psf, "a PSF")
    method, blur = options.method or DEFAULT_METHOD, have.field or psf.psf
    array = restore_large(source, response.curve, blur, method, channels=source.color)
    run(storing(array, output, scheduler=arguments.scheduler, source=source))
    return Report(
        title=f"{arguments.photo.name}, {_place(source, region)}",
        photo=have.photo,
        edges=have.edges or (),
        groups=have.groups or (),
        responses=response.estimates,
        psf=_seen(psf),
        field=have.field,
        sharp=read_part(open_source(output), region) if arguments.report else None,
    )


def _sides(source: Source, options: DeblurOptions) -> tuple[int, ...]:
    """Rows and columns of the part that is looked at; all of them if the blur varies."""
    if options.regions is not None:
        return source.shape[: len(source.shape) - source.color][-2:]
    whole = edges_needed(Intermediates(np.empty((0, 0))), options)
    return () if whole else (GIVEN, GIVEN)


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
