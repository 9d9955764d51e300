"""``crfdeblur estimate``: the response of a camera from one photo or several."""

from argparse import Namespace
from dataclasses import replace

from ..errors import CrfDeblurError
from ..estimate import ResponseEstimate, estimating_responses
from ..io import Output, Outputs, StoredCamera, camera_file, keep_estimate, write_responses
from ..io import responses as response_files
from ..pipeline import profiling
from ..report import Report
from ..texts import printable
from .bar import run
from .choices import deblur_options, fits_named, limits_of
from .deblur import photo_to_deblur, write_extras
from .files import writing
from .saying import say_camera, say_edges, say_responses
from .stored import check_cameras, stored_camera
from .terminal import say


def estimate(arguments: Namespace) -> None:
    """``crfdeblur estimate``."""
    check_cameras(arguments)
    if len(arguments.photos) > 1 and (arguments.edges or arguments.save_edges):
        raise CrfDeblurError("--edges and --save-edges belong to one photo; give one at a time")
    method, output = fits_named(arguments), arguments.output
    planned = [Output(output, response_files.SUFFIXES)] if output else []
    folders = [arguments.cameras] if arguments.cameras else []
    with writing(arguments, planned, folders) as outputs:
        paths = arguments.photos
        photos = [photo_to_deblur(path, limits_of(arguments)) for path in paths]
        camera = stored_camera(arguments, paths, photos)
        if camera:
            outputs.add(_camera_output(camera))
            say_camera(camera)
            paths, photos = ([each[i] for i in camera.used] for each in (paths, photos))
            method = camera.method(method)
        options = replace(deblur_options(arguments), response=method)
        seen = [run(profiling(photo, options, index)) for index, photo in enumerate(photos)]
        groups = [group for each in seen for group in each.groups or ()]
        found = run(estimating_responses(groups, method)).estimates
        found = camera.told(found) if camera else found
        if output:
            write_responses(outputs[output], found)
        title = printable(", ".join(path.name for path in paths))
        report = Report(title, photos[0], seen[0].edges or (), groups, found)
        write_extras(arguments, report, outputs)
        kept = _keep(camera, found[0], outputs) if camera else ""
    for each in seen:
        say_edges(each.edges or ())
    say_responses(found, camera)
    if output:
        say(f"wrote {output}")
    if kept:
        say(kept)


def _camera_output(camera: StoredCamera) -> Output:
    """The file of a camera."""
    return Output(camera_file(camera.folder, camera.key), (".json",))


def _keep(camera: StoredCamera, found: ResponseEstimate, outputs: Outputs) -> str:
    """Write what is known of a camera; the sentence that says so."""
    place = outputs[_camera_output(camera).path]
    return keep_estimate(camera, found, place.parent)
