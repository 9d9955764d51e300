"""What is assumed of the camera, from which the most probable response starts."""

from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from magicgui.widgets import ComboBox, Container, Label, PushButton
from magicgui.widgets.bases import Widget
from napari.layers import Image as ImageLayer
from napari.layers import Layer
from qtpy.QtWidgets import QComboBox, QSizePolicy

from ...errors import CrfDeblurError
from ...estimate import MaximumLikelihood, ResponseFit
from ...io import CameraKey, read_responses
from ...io.responses import responses_from
from ...response import Cameras, ResponseCurve, ResponsePrior, around
from ..outputs import made_of
from ..pixels import KEY
from ..session.facade import Session
from .stored import StoredCameras

Choice: TypeAlias = Cameras | CameraKey | Layer | Path
LEAST_LENGTH = 16  # characters


class CameraBox(Container[Widget]):
    """What is assumed of the camera: a kind, a stored one, or a response that it is close to.

    Parameters
    ----------
    session : Session
        Whose layers and photos know of responses.
    stored : StoredCameras
        The cameras of which something is stored; that of the photo is chosen once it is known.
    *buttons : PushButton
        Buttons that ask for more to choose from.
    """

    def __init__(self, session: Session, stored: StoredCameras, *buttons: PushButton) -> None:
        super().__init__(layout="horizontal", labels=False)
        self.margins = (0, 0, 0, 0)
        self._session, self._stored = session, stored
        self._paths: list[Path] = []
        self._choice = ComboBox(
            choices=self._found,
            tooltip="what is assumed of the camera before its edges are seen: the weaker they "
            "are, the more it counts",
        )
        box = self._choice.native  # whose longest name would make the dock as wide
        box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        box.setMinimumContentsLength(LEAST_LENGTH)
        box.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.extend([Label(value="camera"), self._choice, *buttons])
        self._choice.changed.connect(self._tell)
        stored.changed_cameras.connect(self._choose_stored)

    @property
    def chosen(self) -> Choice:
        """A kind of camera, a stored one, or what knows the response that it is close to."""
        return self._choice.value

    @chosen.setter
    def chosen(self, value: Choice) -> None:
        self._choice.value = value

    @property
    def offered(self) -> tuple[Choice, ...]:
        """All that can be chosen."""
        return self._choice.choices

    @property
    def key(self) -> CameraKey | None:
        """The stored camera that is chosen, if it is one."""
        return self.chosen if isinstance(self.chosen, CameraKey) else None

    def method(self, method: MaximumLikelihood) -> ResponseFit:
        """The method with what is assumed; a stored estimate as it is if it knows the photo.

        Raises
        ------
        CrfDeblurError
            The chosen layer or file holds no single response; nothing is stored any more.
        """
        if self.key is not None:
            return self._stored.method(self.key, method)
        return replace(method, prior=self._prior(self.chosen))

    def _prior(self, chosen: Cameras | Layer | Path) -> Cameras | ResponsePrior:
        if isinstance(chosen, Cameras):
            return chosen
        if isinstance(chosen, Path):
            return around(_single(read_responses(chosen), chosen.name))
        known = _told(self._session, chosen)
        if known is not None:
            return known
        name = f"“{chosen.name}”"
        return around(_single(responses_from(_recorded(chosen), name), name))

    def add_file(self, path: Path) -> None:
        """Assume that the camera is close to the response in a JSON file."""
        _single(read_responses(path), path.name)
        self._paths += [path] if path not in self._paths else []
        self.refresh()
        self.chosen = path

    def refresh(self) -> None:
        """Offer what there is now; the chosen one stays if it still is."""
        self._choice.reset_choices()

    def _tell(self) -> None:
        self._stored.tell(self.key)

    def _choose_stored(self) -> None:
        """Offer the stored cameras, and choose that of the photo if it is one."""
        self.refresh()
        if self._stored.preferred is not None:
            self.chosen = self._stored.preferred
        self._tell()

    def _found(self, _: Any) -> list[tuple[str, Choice]]:
        """Kinds of camera, and responses from elsewhere: what these edges told is no news."""
        photo = self._session.photo
        own = {} if photo is None else made_of(self._session, photo)
        layers = [x for x in self._session.viewer.layers if x is not photo and x not in own]
        told = [layer for layer in layers if _told(self._session, layer) is not None]
        made = [layer for layer in layers if _recorded(layer)]
        close = [layer for layer in made if layer not in told]
        return [
            *((kind.value, kind) for kind in Cameras),
            *((f"stored: {key}", key) for key in self._stored.keys),
            *((f"that of “{layer.name}”", layer) for layer in told),
            *((f"close to that of “{layer.name}”", layer) for layer in close),
            *((f"close to {path.name}", path) for path in self._paths),
        ]


def _told(session: Session, layer: Layer) -> ResponsePrior | None:
    """What the edges of another photo told of its camera."""
    fitted = session.state_of(layer).fitted if isinstance(layer, ImageLayer) else None
    return fitted.estimates[0].posterior if fitted and len(fitted.estimates) == 1 else None


def _single(curves: tuple[ResponseCurve, ...], name: str) -> ResponseCurve:
    """The curve of all channels."""
    if len(curves) != 1:
        raise CrfDeblurError(
            f"{name}: has a curve for each channel; assume a response of one curve for all"
        )
    return curves[0]


def _recorded(layer: Layer) -> Any:
    """The response with which a layer was made, or which it shows, if there is one."""
    return (layer.metadata.get(KEY) or {}).get("response")
