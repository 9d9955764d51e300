"""Options that several commands have."""

from argparse import ArgumentParser
from pathlib import Path

from .. import methods
from ..methods import words
from . import kinds

RESPONSE_HELP = "auto (estimate it), gamma:2.2, srgb, identity, or a response file (.json)"
PSFS = ("auto", *words(methods.PSFS))
PSF_HELP = (
    "auto (from the picture), edges (from them alone), streaks (from those of lamps), variational, "
    "xu-jia, fergus, shan (from the picture by these methods), or a file (.png, .tif, .npy)"
)
METHODS = words(methods.DECONVOLUTIONS)


def output(
    command: ArgumentParser,
    metavar: str,
    text: str,
    default: Path | None = None,
    *,
    required: bool = False,
) -> None:
    """``-o``, ``--output``."""
    command.add_argument(
        "-o",
        "--output",
        type=kinds.file_name,
        default=default,
        required=required,
        metavar=metavar,
        help=text,
    )


def photo_argument(command: ArgumentParser, text: str = "PNG, JPEG or TIFF") -> None:
    """``PHOTO``."""
    command.add_argument("photo", type=kinds.file_name, metavar="PHOTO", help=text)


def photos(command: ArgumentParser, text: str = "PNG, JPEG or TIFF") -> None:
    """``PHOTO ...``."""
    command.add_argument("photos", type=kinds.file_name, nargs="+", metavar="PHOTO", help=text)


def response(command: ArgumentParser, of: str = "", auto: str = "auto") -> None:
    """``--response``, and ``--prior``."""
    command.add_argument(
        "--response",
        type=kinds.word,
        default="auto",
        metavar="RESPONSE",
        help=f"{of}{RESPONSE_HELP} (default: {auto})",
    )
    prior(command)


def method(command: ArgumentParser) -> None:
    """``--method`` of deconvolution, ``--strength`` of it, what keeps it from ringing."""
    command.add_argument(
        "--method",
        choices=METHODS,
        default=METHODS[0],
        help=f"deconvolution (default: {METHODS[0]})",
    )
    command.add_argument(
        "--strength",
        type=kinds.between(0, methods.MOST_STRENGTH),
        default=1.0,
        metavar="NUMBER",
        help="how much of it: 0 is the photo as it was, 1 what is found right, 2 the most "
        "(default: 1)",
    )
    command.add_argument(
        "--no-guard",
        dest="guard",
        action="store_false",
        help="hand out the result as it is, even where it is impossible",
    )
    command.add_argument(
        "--keep-response",
        dest="settle_light",
        action="store_false",
        help="where the photo cannot tell its response, keep what is assumed, even if it rings",
    )


def seed(command: ArgumentParser) -> None:
    """``--seed``."""
    command.add_argument(
        "--seed",
        type=kinds.seed_number,
        default=0,
        metavar="NUMBER",
        help=f"draw another scene: 0 to {kinds.LARGEST_SEED} (default: 0)",
    )


def prior(command: ArgumentParser) -> None:
    """``--prior``."""
    command.add_argument(
        "--prior",
        type=kinds.word,
        metavar="KIND",
        help="what is assumed of a camera of which nothing is stored: digital, dorf (film and "
        "digital), srgb, or a response file of it or one like it (default: digital)",
    )


def cameras(command: ArgumentParser) -> None:
    """``--cameras`` and ``--camera``."""
    command.add_argument(
        "--cameras",
        type=kinds.file_name,
        metavar="FOLDER",
        help="stored cameras: start from what other photos have told of this one",
    )
    command.add_argument(
        "--camera",
        type=kinds.name,
        metavar="NAME",
        help="name of the camera, with --cameras (default: what the photo says)",
    )


def psf_size(command: ArgumentParser) -> None:
    """``--psf-size``."""
    command.add_argument(
        "--psf-size",
        type=kinds.odd_pixels,
        metavar="PIXELS",
        help=f"largest extent of the PSF, 3 to {kinds.LARGEST_PSF} "
        "(default: found from the picture)",
    )


def psf_at(command: ArgumentParser) -> None:
    """``--psf-at``."""
    command.add_argument(
        "--psf-at",
        type=kinds.box,
        action="append",
        metavar="ROW,COLUMN,SIZE",
        help="the PSF is the streak of a lamp, or a point, in a box around this place, SIZE of "
        f"{kinds.SMALLEST_BOX} to {kinds.LARGEST_PSF} pixels; repeated for the mean of several",
    )


def edges(command: ArgumentParser) -> None:
    """``--edges`` and ``--save-edges``, and what :func:`extent` has."""
    command.add_argument(
        "--edges",
        type=kinds.file_name,
        metavar="FILE",
        help="edges to use (.json) instead of finding them",
    )
    command.add_argument(
        "--save-edges",
        type=kinds.file_name,
        metavar="FILE",
        help="write the edges that were found (.json, or .csv for a spreadsheet)",
    )
    extent(command)


def extent(command: ArgumentParser) -> None:
    """``--blur-extent`` and ``--per-channel``."""
    command.add_argument(
        "--blur-extent",
        type=kinds.extent,
        metavar="PIXELS",
        help="largest width of a blurred edge, at most that of the photo "
        "(default: judged from the photo)",
    )
    command.add_argument(
        "--per-channel",
        action="store_true",
        help="one response for each color channel instead of one for all",
    )


def scheduler(command: ArgumentParser) -> None:
    """``--scheduler``."""
    command.add_argument(
        "--scheduler",
        type=kinds.address,
        metavar="ADDRESS",
        help="let the workers of a dask.distributed cluster do the work, such as tcp://host:8786",
    )


def report(command: ArgumentParser) -> None:
    """``--report``."""
    command.add_argument(
        "--report",
        type=kinds.file_name,
        metavar="FILE",
        help="write a page that shows what was found (.html or .png)",
    )


def largest(command: ArgumentParser) -> None:
    """``--largest-photo``."""
    command.add_argument(
        "--largest-photo",
        type=kinds.between(0, 1e6, above=True),
        metavar="MEGAPIXELS",
        help="the largest photo that is read (default: 500)",
    )
