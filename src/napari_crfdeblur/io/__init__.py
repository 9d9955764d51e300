"""Photos, responses, PSFs and edges from and to files, and all that the stages know as JSON."""

from .edges import read_edges, write_edges
from .files import check_folder, check_output, make_folder, write_text
from .images import read_photo, write_photo
from .psfs import read_psf, write_psf
from .records import from_record, to_record
from .responses import read_responses, write_responses

__all__ = [
    "check_folder",
    "check_output",
    "from_record",
    "make_folder",
    "read_edges",
    "read_photo",
    "read_psf",
    "read_responses",
    "to_record",
    "write_edges",
    "write_photo",
    "write_psf",
    "write_responses",
    "write_text",
]
