"""The verbs of a session, by what they are about; each does a step of :mod:`~.steps` at once."""

from .blur import BlurVerbs
from .edges import EdgeVerbs
from .others import OtherPhotosVerbs
from .record import RecordVerbs
from .response import ResponseVerbs
from .restore import RestoreVerbs

__all__ = [
    "BlurVerbs",
    "EdgeVerbs",
    "OtherPhotosVerbs",
    "RecordVerbs",
    "ResponseVerbs",
    "RestoreVerbs",
]
