"""Which camera took a photo, and how it rendered it, as the photo's EXIF data say."""

import hashlib
import json
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from ..errors import DAMAGED
from ..texts import printable
from .images import opened_by_pillow
from .inputs import open_input
from .quiet import quiet

LEVELS = {0: "normal", 1: "soft", 2: "hard"}
# What EXIF 2.32 (CIPA DC-008, section 4.6.5) says of the rendering; sharpness acts on edges.
RENDERING: dict[str, tuple[str, dict[int, str]]] = {
    "Contrast": ("contrast {}", LEVELS),
    "Saturation": ("saturation {}", {0: "normal", 1: "low", 2: "high"}),
    "Sharpness": ("sharpness {}", LEVELS),
    "CustomRendered": ("{} process", {0: "normal", 1: "custom"}),
    "ColorSpace": ("{} colors", {1: "sRGB", 0xFFFF: "uncalibrated"}),
    "SceneCaptureType": (
        "{} scene",
        {0: "standard", 1: "landscape", 2: "portrait", 3: "night"},
    ),
}
# Names by which programs that change tones sign; cameras sign with their firmware.
EDITORS = re.compile(
    r"acdsee|adobe|affinity|capture one|darktable|digikam|dxo|gimp|imagemagick|irfanview|"
    r"lightroom|luminar|paint|photoscape|photoshop|picasa|pixelmator|rawtherapee|snapseed|xnview",
    re.IGNORECASE,
)
# A camera is done with a photo this long after its exposure began, even with a very long one.
DEVELOPED = timedelta(hours=1)
LONGEST = 500  # characters of a text that are looked at; names of cameras have a few dozen
NAME_CHARACTERS = 40  # of a file's name that can be read


@dataclass(frozen=True, slots=True)
class CameraKey:
    """What photos must have in common to be of one response.

    Parameters
    ----------
    maker, model : str
        Of the camera.
    style : str
        Settings that change its response, and its firmware, as far as the photo states them.
    edited : str
        What shows that a program changed the picture after the camera; empty if nothing does.
    """

    maker: str
    model: str
    style: str = ""
    edited: str = ""

    def __post_init__(self) -> None:
        if not self.model.strip():
            raise ValueError("expected the name of a camera, got none")

    @property
    def name(self) -> str:
        """Maker and model as people write them, fit for a sentence."""
        return printable(self._name)

    @property
    def _name(self) -> str:
        first = self.maker.split(" ")[0].lower()
        known = not first or self.model.lower().startswith(first)
        return self.model if known else f"{self.maker} {self.model}"

    def __str__(self) -> str:
        details = [printable(text) for text in (self.style, self.edited) if text]
        return f"{self.name} ({', '.join(details)})" if details else self.name

    @property
    def file_name(self) -> str:
        """Name of its file: the camera's, and what tells it from others of this name."""
        plain = unicodedata.normalize("NFKD", self._name).encode("ascii", "ignore").decode()
        slug = re.sub(r"[^a-z0-9]+", "-", plain.lower()).strip("-")[:NAME_CHARACTERS]
        digest = hashlib.sha256(json.dumps(asdict(self)).encode()).hexdigest()[:10]
        return f"{slug or 'camera'}-{digest}.json"


def read_camera_key(path: Path) -> CameraKey | None:
    """Read which camera took a photo, and how it rendered it.

    Only standard tags are read. What a camera notes in a form of its own, such as the name of
    its picture style, is not known.

    Parameters
    ----------
    path : Path
        PNG, JPEG or TIFF.

    Returns
    -------
    CameraKey or None
        None if the photo does not say, or if what it says is damaged.

    Raises
    ------
    CrfDeblurError
        There is no such file, or it may not be read.
    """
    tags = _tags(path)
    model = _text(tags.get("Model"))
    if not model:
        return None
    return CameraKey(_text(tags.get("Make")), model, _style(tags), _edited(tags))


def _tags(path: Path) -> dict[str, Any]:
    """EXIF data by name; none if they are missing or damaged."""
    from PIL import Image as Pillow
    from PIL.ExifTags import IFD, TAGS

    try:
        with quiet(), open_input(path) as file:
            exif = Pillow.Exif()
            if file.read(4) in (b"II*\0", b"MM\0*"):  # whose pixels Pillow may not know
                file.seek(0)
                exif.load_from_fp(file)
            else:
                file.seek(0)
                exif = opened_by_pillow(file).getexif()
            found = {**exif, **exif.get_ifd(IFD.Exif)}
    except DAMAGED:
        return {}
    return {TAGS[number]: value for number, value in found.items() if number in TAGS}


def _style(tags: Mapping[str, Any]) -> str:
    parts = [
        text.format(names.get(tags[name], tags[name]))
        for name, (text, names) in RENDERING.items()
        if isinstance(tags.get(name), int)
    ]
    software = _text(tags.get("Software"))
    return ", ".join([*parts, *([f"software {software}"] if software else [])])


def _edited(tags: Mapping[str, Any]) -> str:
    """What shows that a program has changed a picture: its name, or that it was saved later."""
    for name in ("ProcessingSoftware", "Software"):
        program = _text(tags.get(name))
        if EDITORS.search(program) or (program and name == "ProcessingSoftware"):
            return f"edited with {program}"
    taken, saved = _time(tags.get("DateTimeOriginal")), _time(tags.get("DateTime"))
    if taken and saved and saved - taken > DEVELOPED:
        return "saved again after it was taken"
    return ""


def _text(value: object) -> str:
    """A text without what pads it or cannot be printed; empty for anything else."""
    if not isinstance(value, str):
        return ""
    plain = "".join(each if each.isprintable() else " " for each in value[:LONGEST])
    return " ".join(plain.split())


def _time(value: object) -> datetime | None:
    try:
        return datetime.strptime(_text(value), "%Y:%m:%d %H:%M:%S")
    except ValueError:
        return None
