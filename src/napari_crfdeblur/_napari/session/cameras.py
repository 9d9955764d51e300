"""Steps with stored cameras."""

from collections.abc import Callable
from pathlib import Path

from ...errors import CrfDeblurError
from ...io import CameraKey, keep_estimate
from ...progress import Job, Progress
from ..cameras import CameraFolder, check_kept, looking_up, picture_file_of
from .step import Step, at_once
from .workspace import Workspace


def looking_up_cameras(
    session: Workspace, folder: Path, take: Callable[[CameraFolder], object]
) -> Step[CameraFolder, None]:
    """Which cameras a folder has, and which of them took the photo.

    Parameters
    ----------
    session : Workspace
    folder : Path
    take : callable
        Gets what was found, unless another photo is at work by then.
    """
    photo, source = session.source()
    job = looking_up(source, session.plane(None), picture_file_of(photo), folder)

    @at_once
    def finish(found: CameraFolder) -> None:
        if session.photo is photo:
            take(found)

    return Step("looking for the camera", job, finish)


def keeping_camera(session: Workspace, known: CameraFolder, key: CameraKey) -> Step[str, str]:
    """Store what is known of a camera after the photo, whose estimate started from it.

    Raises
    ------
    CrfDeblurError
        The estimate rests on more or less than that; the message says what to do.
    """
    fitted, camera = session.required_response(), known.stored(key)
    check_kept(fitted, camera)
    if session.state.live is not None:
        raise CrfDeblurError("the response still follows the edges: wait for the full estimate")

    def job() -> Job[str]:
        yield Progress("storing the camera", 0, 1)
        return keep_estimate(camera, fitted.estimates[0])

    @at_once
    def finish(said: str) -> str:
        session.say(f"{key.name}: {said}")
        return said

    return Step("storing the camera", job(), finish)
