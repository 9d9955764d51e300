"""What each command does: read, run the stages, write, and say what came out."""

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import replace
from math import radians
from pathlib import Path

from .. import demo as demonstration
from .._typing import FloatArray, Image
from ..edges import Edge
from ..errors import CrfDeblurError
from ..estimate import GivenResponse, ResponseEstimate
from ..io import (
    Output,
    Outputs,
    StoredCamera,
    camera_file,
    images,
    keep_estimate,
    psfs,
    read_edges,
    read_photo,
    write_edges,
    write_photo,
    write_psf,
    write_responses,
)
from ..io import responses as response_files
from ..photo import check_photo
from ..pipeline import (
    DeblurOptions,
    deblurring,
    estimating_responses,
    finding_blur,
    gathering_profiles,
    seeking_edges,
)
from ..psf import PsfEstimate, PsfField, PsfStatus
from ..report import Report, write_report
from ..simulate import Camera, CameraMotion, Scene, camera_turn, slanted_edges, step_image, street
from ..simulate import simulate as expose
from ..texts import printable
from .bar import run
from .batch import batch as batch  # one of the commands
from .choices import (
    DECONVOLVERS,
    fits_named,
    known_response,
    psf_estimator,
    response_fits,
    simulated_psf,
)
from .files import beside, photo_or_zarr, writing
from .large import ENDINGS, check_large, deblur_in_tiles, default_output, wants_tiles
from .limits import check_fits
from .stored import check_cameras, stored_camera
from .terminal import say


def demo(arguments: Namespace) -> None:
    """``crfdeblur demo``."""
    with demonstration.writing(arguments.output) as outputs:
        result = run(demonstration.demonstrating(arguments.seed))
        demonstration.write(result, arguments.output, outputs)
    for line in demonstration.table(result).splitlines():
        say(line)
    say("")
    say(f"The pictures are in {arguments.output}/; start with report.html.")


def deblur(arguments: Namespace) -> None:
    """``crfdeblur deblur``."""
    options = _deblur_options(arguments)
    if wants_tiles(arguments, options):
        return _deblur_in_tiles(arguments, options)
    output = arguments.output or _beside(arguments.photo, "-deblurred", images.WRITABLE)
    check_cameras(arguments)
    with writing(arguments, [Output(output, images.WRITABLE)]) as outputs:
        photo = _photo(arguments, arguments.photo)
        camera = _camera(arguments, photo)
        result = run(deblurring(photo, _from(camera, options)))
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
        )
        _write_extras(arguments, report, outputs)
    _say_edges(result.edges)
    _say_responses(responses, camera)
    _say_psf(result.psf)
    if result.field:
        _say_field(result.field)
    if result.clipped > 0.02:
        say(f"clipped: {result.clipped:.0%} of the deblurred values left the intensity range")
    say(f"wrote {output}")


def _deblur_in_tiles(arguments: Namespace, options: DeblurOptions) -> None:
    output = arguments.output or default_output(arguments.photo)
    check_large(arguments, output, options)
    if arguments.cameras or arguments.camera:
        raise CrfDeblurError(
            "--cameras is for photos that are worked on as a whole; estimate the response first, "
            "and give it with --response"
        )
    with writing(arguments, [photo_or_zarr(output, ENDINGS)]) as outputs:
        found, report = deblur_in_tiles(arguments, outputs[output], options)
        _write_extras(arguments, report, outputs)
    _say_edges(found.edges)
    _say_responses(found.responses)
    _say_psf(found.psf)
    if found.field:
        _say_field(found.field)
    say(f"wrote {output}")


def _deblur_options(arguments: Namespace) -> DeblurOptions:
    return replace(
        _options(arguments),
        response=response_fits(arguments),
        psf=psf_estimator(arguments.psf, arguments.psf_size),
        method=DECONVOLVERS[arguments.method](),
        regions=arguments.varying,
    )


def estimate(arguments: Namespace) -> None:
    """``crfdeblur estimate``."""
    check_cameras(arguments)
    if len(arguments.photos) > 1 and (arguments.edges or arguments.save_edges):
        raise CrfDeblurError("--edges and --save-edges belong to one photo; give one at a time")
    options, method = _options(arguments), fits_named(arguments)
    output = arguments.output
    planned = [Output(output, response_files.SUFFIXES)] if output else []
    folders = [arguments.cameras] if arguments.cameras else []
    with writing(arguments, planned, folders) as outputs:
        paths = arguments.photos
        photos = [_photo(arguments, path) for path in paths]
        camera = stored_camera(arguments, paths, photos)
        if camera:
            outputs.add(_camera_output(camera))
            _say_camera(camera)
            paths, photos = ([each[i] for i in camera.used] for each in (paths, photos))
            method = camera.method(method)
        edges = [run(seeking_edges(photo, options)) for photo in photos]
        groups = [
            group
            for index, (photo, own) in enumerate(zip(photos, edges, strict=True))
            for group in run(gathering_profiles(method, photo, own, index))
        ]
        found = run(estimating_responses(groups, method))
        found = camera.told(found) if camera else found
        if output:
            write_responses(outputs[output], found)
        title = printable(", ".join(path.name for path in paths))
        report = Report(title, photos[0], edges[0], groups, found)
        _write_extras(arguments, report, outputs)
        kept = _keep(camera, found[0], outputs) if camera else ""
    for own in edges:
        _say_edges(own)
    _say_responses(found, camera)
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


def psf(arguments: Namespace) -> None:
    """``crfdeblur psf``."""
    output = arguments.output or beside(arguments.photo, f"{arguments.photo.stem}-psf.png")
    check_cameras(arguments)
    options = replace(
        _options(arguments),
        response=response_fits(arguments),
        psf=psf_estimator(arguments.psf, arguments.psf_size),
    )
    with writing(arguments, [Output(output, psfs.SUFFIXES)]) as outputs:
        photo = _photo(arguments, arguments.photo)
        camera = _camera(arguments, photo)
        found = run(finding_blur(photo, _from(camera, options)))
        responses = camera.told(found.responses) if camera else found.responses
        write_psf(outputs[output], found.psf.psf)
        title = printable(arguments.photo.name)
        report = Report(title, photo, found.edges, found.groups, responses, found.psf)
        _write_extras(arguments, report, outputs)
    _say_responses(responses, camera)
    _say_psf(found.psf)
    say(f"wrote {output}")


def simulate(arguments: Namespace) -> None:
    """``crfdeblur simulate``."""
    files = _simulated_files(arguments.output)
    with writing(arguments, files.values()) as outputs:
        blur = _simulated_blur(arguments)
        response = (
            demonstration.RESPONSE
            if arguments.response == "camera"
            else known_response(arguments.response)[0]
        )
        camera = Camera(response, noise=arguments.noise, bits=arguments.bits)
        rows, columns = (
            side + 2 * reach
            for side, reach in zip(arguments.size, _reach(blur, arguments), strict=True)
        )
        scene = _scene(arguments.scene, (rows, columns), arguments.seed)
        result = expose(scene, blur, camera, seed=arguments.seed)
        write_photo(outputs[files["photo"].path], result.photo)
        write_photo(outputs[files["sharp"].path], result.sharp)
        write_psf(outputs[files["psf"].path], result.psf)
        write_responses(outputs[files["response"].path], [GivenResponse(response).estimate()])
    say("wrote " + ", ".join(str(each.path) for each in files.values()))


def _simulated_files(photo: Path) -> dict[str, Output]:
    """The photo, and what is written beside it."""
    endings = {"sharp": photo.suffix, "psf": ".npy", "response": ".json"}
    others = {
        name: Output(beside(photo, f"{photo.stem}-{name}{suffix}"), (suffix.lower(),))
        for name, suffix in endings.items()
    }
    return {"photo": Output(photo, images.WRITABLE), **others}


def _simulated_blur(arguments: Namespace) -> FloatArray | CameraMotion:
    """What ``--psf`` and ``--turn`` say."""
    if not arguments.turn:
        return simulated_psf(arguments.psf, arguments.psf_size, arguments.seed)
    if arguments.psf != "shake":
        raise CrfDeblurError("--turn is for a shake of the camera: leave out --psf")
    turn, shape = radians(arguments.turn), arguments.size
    return camera_turn(arguments.psf_size, turn, arguments.seed, shape)


def _reach(blur: FloatArray | CameraMotion, arguments: Namespace) -> tuple[int, int]:
    """Rows and columns at the borders that are lost to a blur."""
    if isinstance(blur, CameraMotion):
        return blur.reach_for(arguments.size)
    return blur.shape[0] // 2, blur.shape[1] // 2


def _scene(name: str, shape: tuple[int, int], seed: int) -> Scene:
    if name == "street":
        return street(shape, seed=seed)
    return slanted_edges(shape, seed=seed) if name == "slanted" else step_image(shape)


def _options(arguments: Namespace) -> DeblurOptions:
    """What ``--edges`` and ``--blur-extent`` say."""
    edges = read_edges(arguments.edges) if arguments.edges else None
    return DeblurOptions(edges=edges, blur_extent=arguments.blur_extent)


def _photo(arguments: Namespace, path: Path) -> Image:
    """A photo that the options fit."""
    photo = read_photo(path)
    try:
        check_photo(photo)
    except CrfDeblurError as error:
        raise CrfDeblurError(f"{path}: {error}") from error
    check_fits(arguments, path, (photo.shape[0], photo.shape[1]))
    return photo


def _camera(arguments: Namespace, photo: Image) -> StoredCamera | None:
    """The stored camera of the photo; says what is known of it."""
    camera = stored_camera(arguments, [arguments.photo], [photo])
    if camera:
        _say_camera(camera)
    return camera


def _from(camera: StoredCamera | None, options: DeblurOptions) -> DeblurOptions:
    """The options with what is stored of the camera."""
    return replace(options, response=camera.method(options.response)) if camera else options


def _beside(photo: Path, ending: str, suffixes: Sequence[str]) -> Path:
    """Default name of a result, in a kind of file that can be written."""
    suffix = photo.suffix if photo.suffix.lower() in suffixes else ".png"
    return beside(photo, f"{photo.stem}{ending}{suffix}")


def _write_extras(arguments: Namespace, report: Report, outputs: Outputs) -> None:
    if arguments.save_edges:
        write_edges(outputs[arguments.save_edges], report.edges)
    if arguments.report:
        write_report(outputs[arguments.report], report)


def _say_camera(camera: StoredCamera) -> None:
    first, *others = camera.sentences()
    say(first)
    for sentence in others:
        say(f"  {sentence}")


def _say_edges(edges: Sequence[Edge]) -> None:
    if edges:
        say(f"edges: {sum(edge.good for edge in edges)} good of {len(edges)}")


def _say_responses(found: Sequence[ResponseEstimate], camera: StoredCamera | None = None) -> None:
    names = ["response"] if len(found) == 1 else ["response R", "response G", "response B"]
    for name, one in zip(names, found, strict=True):
        low, high = one.covered
        sentence = camera.verdict(one) if camera else one.status.value
        covered = f" (intensity {low:.2f} to {high:.2f})" if low < high else ""
        say(f"{name}: {sentence}{covered}")
        for finding in one.findings:
            say(f"  {finding.value}")


def _say_field(field: PsfField) -> None:
    statuses = [status for row in field.statuses for status in row]
    own = sum(status is not PsfStatus.BORROWED for status in statuses)
    say(
        f"parts: {own} of {len(statuses)} tell their PSF; the camera turned by "
        f"{field.diagnostics['turn']:.2f} degrees (standard deviation)"
    )


def _say_psf(found: PsfEstimate) -> None:
    sides = " x ".join(map(str, reversed(found.psf.shape)))
    say(f"PSF: {sides} pixels; {found.status.value}")
