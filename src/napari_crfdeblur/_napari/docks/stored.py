"""Stored cameras: which one took the photo, and a button that adds this photo to it."""

from pathlib import Path

from magicgui.widgets import Container, PushButton
from magicgui.widgets.bases import Widget
from psygnal import Signal
from qtpy.QtWidgets import QSizePolicy

from ...errors import REFUSALS, CrfDeblurError, in_words
from ...estimate import MaximumLikelihood, ResponseFit
from ...io import CameraKey
from ..cameras import CameraFolder
from ..preferences import prefer_cameras, preferences
from ..session.cameras import keeping_camera, looking_up_cameras
from ..session.facade import Session
from ..session.step import Level, Step
from .forms import row, sentence

LOOKING = "looking for the camera of this photo"


class StoredCameras(Container[Widget]):
    """The stored cameras of a folder, and what they mean for the photo at work.

    Parameters
    ----------
    session : Session
        Whose photo is looked at.
    keep : PushButton
        Button that keeps the estimate of the photo.

    Attributes
    ----------
    changed_cameras : Signal
        Emitted when it is known which cameras there are, and which took the photo.
    """

    changed_cameras = Signal()

    def __init__(self, session: Session, keep: PushButton) -> None:
        super().__init__(labels=False)
        self.margins = (0, 0, 0, 0)
        self._session = session
        self._told = sentence()
        # The sentence takes the room that the button leaves.
        keep.native.setSizePolicy(QSizePolicy.Policy.Maximum, QSizePolicy.Policy.Fixed)
        self.extend([row(self._told, keep)])
        self.known: CameraFolder | None = None
        self._kept: CameraKey | None = None
        stored = preferences().cameras
        self.folder: Path | None = Path(stored) if stored else None
        self.visible = self.folder is not None

    @property
    def preferred(self) -> CameraKey | None:
        """The stored camera to start from: that of the photo, or the one it was added to."""
        if self.known is None:
            return None
        key = self._kept if self._kept in self.keys else self.known.trusted
        return key if key in self.keys else None

    @property
    def keys(self) -> tuple[CameraKey, ...]:
        """The cameras that are stored."""
        return tuple(record.key for record in self.known.records) if self.known else ()

    def choose_folder(self, folder: Path) -> None:
        """Use the cameras of a folder, now and in windows to come."""
        prefer_cameras(folder)
        self.folder = folder
        self.visible = True
        self.look()

    def look(self) -> None:
        """Find out which cameras there are, and which took the photo."""
        self.known = self._kept = None
        self._told.value = ""
        if self.folder is not None and self._session.photo is not None:
            self._told.value = LOOKING
            try:
                self._session.start(self.looking())
            except REFUSALS as error:
                self._session.say(in_words(error), Level.ERROR)
        self.changed_cameras.emit()

    def looking(self) -> Step[CameraFolder, None]:
        """Find out which cameras there are, and which took the photo."""
        return looking_up_cameras(self._session, self._required_folder(), self._take)

    def tell(self, chosen: CameraKey | None) -> None:
        """Say what is known of the camera that is chosen, or else of that of the photo."""
        if self.known is not None:
            self._told.value = self.known.told(chosen)

    def method(self, key: CameraKey, method: MaximumLikelihood) -> ResponseFit:
        """Estimation from what is stored of a camera."""
        return self._required().method(key, method)

    def key(self, chosen: CameraKey | None) -> CameraKey | None:
        """The camera that an estimate is kept for; None if it needs a name."""
        return chosen or self._required().trusted

    def keeping(self, key: CameraKey) -> Step[str, str]:
        """Add the photo to what is stored of a camera."""
        self._kept = key
        return keeping_camera(self._session, self._required(), key)

    def _required_folder(self) -> Path:
        if self.folder is None:
            raise CrfDeblurError("there is no folder of cameras yet: choose one with Stored...")
        return self.folder

    def _required(self) -> CameraFolder:
        self._required_folder()
        if self.known is None:
            raise CrfDeblurError(f"{self.folder}: its cameras are not known yet; wait a moment")
        return self.known

    def _take(self, known: CameraFolder) -> None:
        self.known = known
        self.tell(None)
        self.changed_cameras.emit()
