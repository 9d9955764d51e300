"""The response: estimated from the edges, given or tuned by hand; how far it can be trusted."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from magicgui.widgets import CheckBox
from magicgui.widgets.bases import Widget
from napari.layers import Image as ImageLayer
from napari.layers import Layer

from ...errors import CrfDeblurError
from ...estimate import KnownPsf, MaximumLikelihood, ResponseFit
from ...io import CameraKey, write_responses
from ...io.images import WRITABLE
from ...io.responses import SUFFIXES
from ...pipeline.intermediates import PLANE
from ...response import Cameras
from ..cameras import UNKNOWN
from ..pixels import unwrapped
from ..preferences import preferences
from ..session.response import estimating_response, setting_response
from ..session.state import Fitted
from ..session.step import Message, Step
from .base import Dock, Followed
from .camera import CameraBox
from .choices import PREFERRED, fits
from .files import ask_folder, ask_name, ask_open, ask_open_many, ask_save
from .forms import MethodForm, sentence, tight
from .further import FurtherPhotos
from .known import KnownResponse
from .response_plots import ResponsePlots
from .stored import StoredCameras
from .trust import trust_in_state
from .tuning import Tuning

KNOWN_PSF, KNOWN_PSF_EQ4 = "known PSF", "known PSF, Eq. 4"
SPACING = 4


class ResponseDock(Dock):
    """Find the camera response, see how far it can be trusted, and tune it by hand."""

    def body(self) -> list[Widget]:
        """How the response is found, what it is, and sliders to tune it."""
        self.native.layout().setSpacing(SPACING)
        self._trust = sentence()
        use = self.button(
            "Use this curve", "make the tuned curve the response", lambda: self.use_tuned(False)
        )
        self._tuning = Tuning(self.session, self.runner, use)
        self._plots = ResponsePlots(self.session, lambda: self._tuning.curves)
        return [
            *self._estimating(),
            *self._giving(),
            self._trust,
            self._plots,
            self._tuning,
        ]

    @property
    def tuning(self) -> Tuning:
        """The sliders."""
        return self._tuning

    @property
    def others(self) -> list[ImageLayer | Path]:
        """Further photos of the same camera whose edges are used, too."""
        return self._further.chosen

    @others.setter
    def others(self, photos: Sequence[ImageLayer | Path | str]) -> None:
        self._further.chosen = photos

    def step(self) -> Step[Any, Any]:
        """The response estimated from the edges."""
        if self._per_channel.value and self._camera.visible and self._camera.key is not None:
            raise CrfDeblurError(
                "what is stored of a camera is one curve for all channels: choose a kind of "
                "camera, or do without one curve per channel"
            )
        return estimating_response(
            self.session,
            self._fit(),
            per_channel=bool(self._per_channel.value),
            others=self.others,
        )

    def use(self, block: bool = True) -> Any:
        """Use the response that is chosen under "or use"; in a thread unless it blocks."""
        return self.begin(lambda: setting_response(self.session, self._known.response), block=block)

    def use_tuned(self, block: bool = True) -> Any:
        """Make the tuned curve the response; in a thread unless it blocks."""
        return self.begin(lambda: setting_response(self.session, self._tuning.used()), block=block)

    def load(self, path: Path | str) -> Fitted:
        """Use the response in a JSON file."""
        return self.session.load_response(path)

    def save(self, path: Path | str) -> None:
        """Save the response with its band as JSON."""
        write_responses(Path(path), self.session.required_response().estimates)
        self.session.say(f"the response is saved in {Path(path).name}")

    def assume(self, camera: Cameras | Layer | Path | str) -> None:
        """Assume a kind of camera, or that it is close to the response of a layer or file."""
        if isinstance(camera, str | Path):
            self._camera.add_file(Path(camera))
        else:
            self._camera.chosen = camera if isinstance(camera, Cameras) else unwrapped(camera)

    def use_cameras(self, folder: Path | str) -> None:
        """Use the stored cameras of a folder; that of the photo is chosen if it is stored."""
        self._stored.choose_folder(Path(folder))

    def keep(self, name: str | None = None, *, block: bool = True) -> Any:
        """Add this estimate to what is stored of the camera.

        Parameters
        ----------
        name : str, optional
            Of the camera, if neither the photo says it nor a stored one is chosen.
        block : bool
            Wait for the end and return the sentence that says what is stored now.
        """
        return self.begin(lambda: self._keeping(name), self._stored.looking, block=block)

    def compare(self, path: Path | str | None) -> None:
        """Draw the response in a JSON file beside that of the photo; None draws no other."""
        self._plots.compare(Path(path) if path else None)
        self._compare.text = "Compare no more" if self._plots.compares else "Compare with..."

    def refresh(self) -> None:
        """Show the photo of the session, and offer what there is to choose from."""
        super().refresh()
        self._further.refresh()
        self._known.reset_choices()
        self._camera.refresh()
        photo = self.session.photo
        self._per_channel.enabled = photo is not None and bool(photo.rgb)
        if not self._per_channel.enabled:
            self._per_channel.value = False

    def _estimating(self) -> list[Widget]:
        preferred = PREFERRED[preferences().response]
        methods = self._methods()
        self._method = MethodForm(
            "method",
            methods,
            preferred if preferred in methods else next(iter(methods)),
            "how the response is found from the profiles across the edges",
            without=["prior"],
        )
        near = self.button(
            "File...",
            "assume that the camera is close to the response in a JSON file",
            self._ask_assumed,
        )
        stored = self.button(
            "Stored...",
            "choose the folder in which the estimates of each camera are kept",
            self._ask_cameras,
        )
        keep = self.button(
            "Keep",
            "add this estimate to what is stored of the camera, for its next photos",
            self._ask_keep,
        )
        self._stored = StoredCameras(self.session, keep)
        self._camera = CameraBox(self.session, self._stored, near, stored)
        self._method.edited.connect(self._show_camera)
        self._show_camera()
        self._per_channel = CheckBox(
            text="one curve per channel",
            value=False,
            tooltip="estimate red, green and blue apart, each from its own profiles; "
            "for color photos",
        )
        add = self.button("Add files...", "choose photos that are not open", self._ask_files)
        self._further = FurtherPhotos(self.session, lambda: self._photos(None), add)
        estimate = self.button(
            "Estimate the response",
            "find the curve that makes the profiles across the edges fall on one another",
            lambda: self.run(block=False),
        )
        return [
            self._method,
            self._camera,
            self._stored,
            self._per_channel,
            self._further,
            estimate,
        ]

    def _giving(self) -> list[Widget]:
        use = self.button(
            "Use", "take this response instead of an estimate", lambda: self.use(block=False)
        )
        self._known = KnownResponse(self.session, PREFERRED[preferences().response], use)
        self._compare = self.button(
            "Compare with...", "draw another response beside this one", self._ask_compare
        )
        load = self.button("Load...", "use the response in a JSON file", self._ask_load)
        save = self.button("Save...", "save the response as JSON", self._ask_save)
        return [
            self._known,
            tight(load, save, self._compare, layout="horizontal"),
        ]

    def _say(self, message: Message) -> None:
        """Say it; how far the response can be trusted is said above."""
        super()._say(Message("") if message.text.startswith("response: ") else message)

    def followed(self) -> Followed:
        """The response, and what it is estimated from."""
        session = self.session
        return [
            *super().followed(),
            *self._plots.followed(),
            (session.response_changed, self._show_trust),
            (session.edges_changed, self._show_trust),
            (session.psf_changed, self._offer_methods),
            (session.photo_changed, self._stored.look),
        ]

    def _connect(self) -> None:
        super()._connect()
        self._tuning.toggled.connect(self._plots.redraw_curves)
        self._tuning.moved.connect(self._plots.move_curves)
        self.session.viewer.events.theme.connect(self._show_trust)
        self._show_trust()
        self._stored.look()

    def _opened(self) -> None:
        super()._opened()
        self.session.viewer.events.theme.connect(self._show_trust)
        self._tuning.watch()
        self._stored.look()  # the photo may be another one by now

    def _closed(self) -> None:
        super()._closed()
        self.session.viewer.events.theme.disconnect(self._show_trust)
        self._tuning.end()

    def _methods(self) -> dict[str, Any]:
        known = self.session.state.psf
        if known is None or known.psf.ndim != PLANE:
            return fits()
        psf = known.psf
        return fits() | {KNOWN_PSF: MaximumLikelihood(psf=psf), KNOWN_PSF_EQ4: KnownPsf(psf)}

    def _fit(self) -> ResponseFit:
        """The method with all that is chosen for it."""
        method: ResponseFit = self._method.method
        if isinstance(method, MaximumLikelihood):
            return self._camera.method(method)
        return method

    def _keeping(self, name: str | None) -> Step[str, str]:
        key = self._stored.key(self._camera.key)
        if key is None and not name:
            raise CrfDeblurError(UNKNOWN)
        return self._stored.keeping(key or CameraKey("", str(name)))

    def _show_camera(self) -> None:
        """The methods of the paper assume nothing of the camera."""
        chosen = self._methods().get(self._method.chosen)
        self._camera.visible = isinstance(chosen, MaximumLikelihood)
        self._stored.visible = self._camera.visible and self._stored.folder is not None

    def _offer_methods(self) -> None:
        self._method.offer(self._methods())

    def _show_trust(self) -> None:
        """Say how far the response can be trusted, and what to do if it cannot."""
        state = self.session.state
        self._trust.value = self.shaded(*trust_in_state(state))
        findings = state.shown.findings if state.shown else ()
        self._trust.tooltip = "\n".join(finding.value for finding in findings)

    def _ask_files(self) -> None:
        self._further.add_files(ask_open_many(self.native, "Photos of the same camera", WRITABLE))

    def _ask_assumed(self) -> None:
        path = ask_open(self.native, "Camera response that is close", SUFFIXES)
        if path is not None:
            self.attempt(lambda: self.assume(path))

    def _ask_cameras(self) -> None:
        folder = ask_folder(self.native, "Folder of stored cameras")
        if folder is not None:
            self.attempt(lambda: self.use_cameras(folder))

    def _ask_keep(self) -> None:
        def act() -> None:
            name = None
            if self._stored.key(self._camera.key) is None:
                name = ask_name(self.native, "Stored cameras", "Name of the camera")
                if name is None:
                    return
            self.keep(name, block=False)

        self.attempt(act)

    def _ask_load(self) -> None:
        path = ask_open(self.native, "Camera response", SUFFIXES)
        if path is not None:
            self.attempt(lambda: self.load(path))

    def _ask_save(self) -> None:
        path = ask_save(self.native, "Save the camera response", SUFFIXES)
        if path is not None:
            self.attempt(lambda: self.save(path))

    def _ask_compare(self) -> None:
        if self._plots.compares:
            self.compare(None)
            return
        path = ask_open(self.native, "Camera response to compare with", SUFFIXES)
        if path is not None:
            self.attempt(lambda: self.compare(path))
