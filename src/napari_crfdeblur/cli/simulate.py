"""``crfdeblur simulate`` and ``crfdeblur demo``: photos whose truth is known."""

from argparse import Namespace
from math import radians
from pathlib import Path

from .. import demo as demonstration
from .._typing import FloatArray
from ..errors import CrfDeblurError
from ..estimate import GivenResponse
from ..io import Output, images, write_photo, write_psf, write_responses
from ..psf.base import as_planar_psf
from ..simulate import Camera, CameraMotion, Scene, camera_turn, slanted_edges, step_image, street
from ..simulate import simulate as expose
from .bar import run
from .choices import known_response, simulated_psf
from .files import file_beside, writing
from .terminal import say


def demo(arguments: Namespace) -> None:
    """``crfdeblur demo``."""
    with demonstration.writing_demo(arguments.output) as outputs:
        result = run(demonstration.demonstrating(arguments.seed))
        demonstration.write(result, arguments.output, outputs)
    for line in demonstration.table(result).splitlines():
        say(line)
    say("")
    say(f"The pictures are in {arguments.output}/; start with report.html.")


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
        name: Output(file_beside(photo, f"{photo.stem}-{name}{suffix}"), (suffix.lower(),))
        for name, suffix in endings.items()
    }
    return {"photo": Output(photo, images.WRITABLE), **others}


def _simulated_blur(arguments: Namespace) -> FloatArray | CameraMotion:
    """What ``--psf`` and ``--turn`` say."""
    if not arguments.turn:
        blur = simulated_psf(arguments.psf, arguments.psf_size, arguments.seed)
        as_planar_psf(blur)  # what is none is refused before the scene is drawn
        return blur
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
