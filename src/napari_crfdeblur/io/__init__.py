"""Photos, responses, cameras, PSFs and edges in files, and all that the stages know as JSON."""

from .camera_keys import CameraKey, read_camera_key
from .cameras import (
    CameraRecord,
    CountedPhoto,
    camera_file,
    read_camera,
    stored_cameras,
    write_camera,
)
from .deblur_records import read_record, record_content, record_from, write_record
from .edges import read_edges, write_edges
from .files import check_folder, check_output, make_folder, write_text
from .images import read_photo, write_photo
from .outputs import Output, Outputs, check_apart
from .psfs import read_psf, write_psf
from .records import from_record, to_record
from .responses import read_responses, write_responses
from .stored import StoredCamera, keep_estimate

__all__ = [
    "CameraKey",
    "CameraRecord",
    "CountedPhoto",
    "Output",
    "Outputs",
    "StoredCamera",
    "camera_file",
    "check_apart",
    "check_folder",
    "check_output",
    "from_record",
    "keep_estimate",
    "make_folder",
    "read_camera",
    "read_camera_key",
    "read_edges",
    "read_photo",
    "read_psf",
    "read_record",
    "read_responses",
    "record_content",
    "record_from",
    "stored_cameras",
    "to_record",
    "write_camera",
    "write_edges",
    "write_photo",
    "write_psf",
    "write_record",
    "write_responses",
    "write_text",
]
