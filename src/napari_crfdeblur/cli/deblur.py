"""``crfdeblur deblur`` and ``crfdeblur psf``: the path of one photo, to its end or to the PSF."""

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from .._typing import Image
from ..errors import CrfDeblurError, about
from ..io import (
    Output,
    Outputs,
    StoredCamera,
    images,
    psfs,
    read_photo,
    write_edges,
    write_photo,
    write_psf,
    write_record,
)
from ..io.limits import Limits
from ..large import open_source
from ..large.deblur import stored_stack
from ..photo import check_photo
from ..pipeline import (
    DEFAULT_METHOD,
    DeblurOptions,
    Intermediates,
    Record,
    Stage,
    deblurring,
    walking,
)
from ..pipeline.intermediates import made
from ..pipeline.record import identifying, pixels_of
from ..report import Report, write_report
from ..texts import printable
from .bar import run
from .choices import deblur_options, limits_of
from .files import file_beside, photo_or_zarr, writing
from .large import (
    ENDINGS,
    check_large,
    deblur_in_tiles,
    default_output,
    report_of_tiles,
    wants_tiles,
)
from .saying import say_camera, say_report
from .stored import check_cameras, stored_camera
from .terminal import say

NOTICED = 0.02  # share of clipped values that the user should know of


def deblur(arguments: Namespace) -> None:
    """``crfdeblur deblur``."""
    options = deblur_options(arguments)
    if wants_tiles(arguments, options):
        return _deblur_in_tiles(arguments, options)
    output = arguments.output or _beside(arguments.photo, "-deblurred", images.WRITABLE)
    check_cameras(arguments)
    with writing(arguments, [Output(output, images.WRITABLE)]) as outputs:
        photo = photo_to_deblur(arguments.photo, limits_of(arguments))
        camera = _camera(arguments, photo)
        options = replace(_from(camera, options), method=options.method or DEFAULT_METHOD)
        result = run(deblurring(photo, options))
        responses = camera.told(result.responses) if camera else result.responses
        write_photo(outputs[output], result.photo, like=arguments.photo)
        report = Report(
            title=printable(arguments.photo.name),
            photo=photo,
            edges=result.edges,
            groups=result.groups,
            responses=responses,
            psf=result.psf,
            field=result.field,
            sharp=result.photo,
            trust=result.trust,
        )
        write_extras(arguments, report, outputs)
        if arguments.record:
            record = Record(
                pixels_of(arguments.photo.name, photo),
                options,
                chosen=dict(result.chosen),
                result=pixels_of(output.name, result.photo),
            )
            write_record(outputs[arguments.record], record)
    say_report(report, camera)
    if result.clipped > NOTICED:
        say(f"clipped: {result.clipped:.0%} of the deblurred values left the intensity range")
    say(f"wrote {output}")


def _deblur_in_tiles(arguments: Namespace, options: DeblurOptions) -> None:
    output = arguments.output or default_output(arguments.photo)
    check_large(arguments, output, options)
    with writing(arguments, [photo_or_zarr(output, ENDINGS)]) as outputs:
        photo, place = arguments.photo, outputs[output]
        source = open_source(photo, limits=limits_of(arguments))
        found = deblur_in_tiles(photo, source, place, options, arguments.scheduler)
        report = report_of_tiles(photo, source, found, place if arguments.report else None)
        write_extras(arguments, report, outputs)
        if arguments.record:
            record = Record(
                run(identifying(stored_stack(source, photo.name))),
                found.options,
                tiled=True,
                chosen=dict(found.have.chosen),
                result=run(identifying(stored_stack(open_source(place), output.name))),
            )
            write_record(outputs[arguments.record], record)
    say_report(replace(report, psf=found.have.psf))
    say(f"wrote {output}")


def psf(arguments: Namespace) -> None:
    """``crfdeblur psf``."""
    output = arguments.output or file_beside(arguments.photo, f"{arguments.photo.stem}-psf.png")
    check_cameras(arguments)
    options = deblur_options(arguments)
    with writing(arguments, [Output(output, psfs.SUFFIXES)]) as outputs:
        photo = photo_to_deblur(arguments.photo, limits_of(arguments))
        camera = _camera(arguments, photo)
        have = run(walking(Intermediates(photo), _from(camera, options), until=Stage.PSF))
        found = made(have.psf, "a PSF")
        responses = made(have.response, "a response").estimates
        responses = camera.told(responses) if camera else responses
        write_psf(outputs[output], found.psf)
        title = printable(arguments.photo.name)
        report = Report(title, photo, have.edges or (), have.groups or (), responses, found)
        write_extras(arguments, report, outputs)
    say_report(replace(report, edges=()), camera)
    say(f"wrote {output}")


def photo_to_deblur(path: Path, limits: Limits) -> Image:
    """A photo in which something can be found."""
    photo = read_photo(path, limits=limits)
    try:
        check_photo(photo)
    except CrfDeblurError as error:
        raise about(path, error) from error
    return photo


def write_extras(arguments: Namespace, report: Report, outputs: Outputs) -> None:
    """What ``--save-edges`` and ``--report`` ask for."""
    if arguments.save_edges:
        write_edges(outputs[arguments.save_edges], report.edges)
    if arguments.report:
        write_report(outputs[arguments.report], report)


def _camera(arguments: Namespace, photo: Image) -> StoredCamera | None:
    """The stored camera of the photo; says what is known of it."""
    camera = stored_camera(arguments, [arguments.photo], [photo])
    if camera:
        say_camera(camera)
    return camera


def _from(camera: StoredCamera | None, options: DeblurOptions) -> DeblurOptions:
    """The options with what is stored of the camera."""
    return replace(options, response=camera.method(options.response)) if camera else options


def _beside(photo: Path, ending: str, suffixes: Sequence[str]) -> Path:
    """Default name of a result, in a kind of file that can be written."""
    suffix = photo.suffix if photo.suffix.lower() in suffixes else ".png"
    return file_beside(photo, f"{photo.stem}{ending}{suffix}")
