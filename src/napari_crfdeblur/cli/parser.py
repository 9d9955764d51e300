"""What can be said on the command line; loads nothing but the standard library."""

import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from .._version import __version__
from ..errors import CrfDeblurError
from ..methods import RESPONSES, words
from . import kinds, options
from .terminal import put

FITS = (*words(RESPONSES), "known-psf")


class Parser(ArgumentParser):
    """Says what is wrong in one sentence, and prints help as everything is printed."""

    def error(self, message: str) -> NoReturn:
        """Refuse a mistake."""
        raise CrfDeblurError(f"{message}; `{self.prog} --help` tells the options")

    def _print_message(self, message: str, file: Any = None) -> None:
        # Everything that argparse prints passes here, by the documentation of nobody.
        put(file or sys.stdout, message)


def parse(argv: Sequence[str] | None) -> Namespace:
    """Read the arguments; on ``--help``, argparse ends the program.

    Raises
    ------
    CrfDeblurError
        They cannot be understood.
    """
    parser = Parser(
        prog="crfdeblur",
        description="Deblur photos in linear light, with the camera response estimated from "
        "the straight edges of the blurred photo itself.",
        epilog="`crfdeblur COMMAND --help` tells the options of a command.",
    )
    parser.add_argument("--version", action="version", version=f"crfdeblur {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for add in (_demo, _deblur, _repeat, _batch, _estimate, _psf, _simulate):
        add(_adder(commands.add_parser))
    return parser.parse_args(argv)


Add = Callable[[str, str, str], ArgumentParser]


def _adder(add_parser: Callable[..., ArgumentParser]) -> Add:
    def add(name: str, summary: str, example: str) -> ArgumentParser:
        return add_parser(
            name,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.",
            epilog=f"example:\n  {example}",
            formatter_class=RawDescriptionHelpFormatter,
        )

    return add


def _demo(add: Add) -> None:
    demo = add(
        "demo",
        "blur a known picture, recover it, and compare the responses",
        "crfdeblur demo -o demo",
    )
    folder = Path("demo")
    options.output(demo, "FOLDER", "folder for the pictures (default: demo)", folder)
    options.seed(demo)


def _deblur(add: Add) -> None:
    deblur = add(
        "deblur",
        "deblur a photo",
        "crfdeblur deblur photo.jpg -o sharp.png --report report.html",
    )
    options.photo_argument(deblur, "PNG, JPEG or TIFF; in tiles NPY and zarr, too")
    options.output(deblur, "FILE", "deblurred photo (default: PHOTO-deblurred beside the photo)")
    options.response(deblur)
    options.cameras(deblur)
    deblur.add_argument(
        "--psf",
        type=kinds.word,
        default="auto",
        metavar="PSF",
        help=f"{options.PSF_HELP} (default: auto)",
    )
    options.method(deblur)
    options.psf_size(deblur)
    options.psf_at(deblur)
    options.edges(deblur)
    options.report(deblur)
    options.largest(deblur)
    deblur.add_argument(
        "--varying",
        type=kinds.grid,
        nargs="?",
        const=4,
        metavar="ROWSxCOLUMNS",
        help=f"for a camera that turned: a PSF for each of so many parts of the photo, 1 to "
        f"{kinds.MOST_PARTS} each (default: 4 along the longer side)",
    )
    deblur.add_argument(
        "--tiled",
        action="store_true",
        help="work in tiles, with little memory, on all pages (default: a TIFF of one page "
        "and more than 67 megapixels, and stacks for a PSF of three dimensions)",
    )
    options.scheduler(deblur)
    deblur.add_argument(
        "--record",
        type=kinds.file_name,
        metavar="FILE.json",
        help="write what was done, for `crfdeblur repeat`",
    )


def _repeat(add: Add) -> None:
    repeat = add(
        "repeat",
        "do again what a record says, and say whether the same comes out",
        "crfdeblur repeat sharp.json photo.jpg",
    )
    repeat.add_argument(
        "record_file",
        type=kinds.file_name,
        metavar="RECORD",
        help="what `deblur --record` wrote, or the window exported",
    )
    options.photo_argument(repeat, "the same photo, or another one")
    options.output(repeat, "FILE", "the result (default: it is compared, and not written)")
    options.largest(repeat)


def _batch(add: Add) -> None:
    batch = add(
        "batch",
        "deblur many photos of one camera; go on where an earlier batch stopped",
        "crfdeblur batch photos/*.jpg -o sharp",
    )
    options.photos(batch)
    options.output(
        batch,
        "FOLDER",
        "folder for the deblurred photos and the journal; made if it is missing",
        required=True,
    )
    options.response(batch, "of all photos: ", "auto, from the photos together")
    batch.add_argument(
        "--psf",
        type=kinds.word,
        default="each",
        metavar="PSF",
        help="each (every photo has its own), first (that of the first photo for all), one (one "
        "for all, from several photos), or a file (.png, .tif, .npy) (default: each)",
    )
    options.psf_size(batch)
    options.method(batch)
    batch.add_argument(
        "--suffix",
        type=kinds.suffix,
        default="-deblurred",
        metavar="TEXT",
        help=f"what is added to the name of each photo, up to {kinds.LONGEST_NAME} characters "
        "(default: -deblurred)",
    )
    options.extent(batch)
    options.largest(batch)
    options.scheduler(batch)


def _estimate(add: Add) -> None:
    estimate = add(
        "estimate",
        "estimate the camera response from one photo or several",
        "crfdeblur estimate one.jpg two.jpg -o camera.json",
    )
    options.photos(estimate, "PNG, JPEG or TIFF; several photos of one camera are pooled")
    options.output(
        estimate,
        "FILE.json",
        "response file for `deblur --response`; without it, only a summary",
    )
    estimate.add_argument(
        "--method",
        choices=FITS,
        default="likelihood",
        help="likelihood, or of the paper: rank (Eq. 10), rank-all (Eq. 8), mean (Eq. 5), "
        "known-psf (Eq. 4) (default: likelihood)",
    )
    estimate.add_argument(
        "--psf", type=kinds.file_name, metavar="FILE", help="the PSF, if it is known"
    )
    options.prior(estimate)
    options.cameras(estimate)
    options.edges(estimate)
    options.report(estimate)
    options.largest(estimate)


def _psf(add: Add) -> None:
    psf = add(
        "psf",
        "estimate the point spread function of a photo",
        "crfdeblur psf photo.jpg -o psf.png --response srgb",
    )
    options.photo_argument(psf)
    options.output(
        psf, "FILE", "PSF as .png, .tif or .npy (default: PHOTO-psf.png beside the photo)"
    )
    options.response(psf)
    options.cameras(psf)
    psf.add_argument(
        "--from",
        dest="psf",
        choices=options.PSFS,
        default="auto",
        help="what the PSF is found from: the picture, by the best method or a named one, "
        "straight edges, alone or with it, or the streaks of lamps (default: auto)",
    )
    options.psf_size(psf)
    options.psf_at(psf)
    options.edges(psf)
    options.report(psf)
    options.largest(psf)


def _simulate(add: Add) -> None:
    simulate = add(
        "simulate",
        "make a blurred photo whose truth is known",
        "crfdeblur simulate -o blurred.png --scene street --psf shake --response gamma:2.2",
    )
    options.output(
        simulate,
        "FILE",
        "blurred photo (default: simulated.png); the sharp photo, the PSF and the response are "
        "written beside it",
        Path("simulated.png"),
    )
    simulate.add_argument(
        "--scene",
        choices=("street", "slanted", "step"),
        default="street",
        help="what is photographed (default: street)",
    )
    simulate.add_argument(
        "--psf",
        type=kinds.word,
        default="shake",
        metavar="PSF",
        help="shake, kernel-a, kernel-b, line, disk, gaussian, or a file (default: shake)",
    )
    simulate.add_argument(
        "--psf-size",
        type=kinds.odd_pixels,
        default=21,
        metavar="PIXELS",
        help=f"extent of the blur, 3 to {kinds.LARGEST_PSF} (default: 21)",
    )
    simulate.add_argument(
        "--turn",
        type=kinds.turn,
        default=0.0,
        metavar="DEGREES",
        help=f"by which the camera turns, too, while it shakes, up to {kinds.LARGEST_TURN:g} "
        "to either side (default: 0)",
    )
    simulate.add_argument(
        "--response",
        type=kinds.word,
        default="camera",
        metavar="RESPONSE",
        help="camera (one far from gamma 2.2), gamma:2.2, srgb, identity, or a "
        "response file (default: camera)",
    )
    simulate.add_argument(
        "--size",
        type=kinds.size,
        default=(600, 900),
        metavar="ROWSxCOLUMNS",
        help=f"of the photo, 64 to {kinds.LONGEST_SIDE} each (default: 600x900)",
    )
    simulate.add_argument(
        "--noise",
        type=kinds.noise,
        default=0.002,
        metavar="NUMBER",
        help="standard deviation before the response, 0 to 1 (default: 0.002)",
    )
    simulate.add_argument(
        "--bits", type=int, choices=(8, 16), default=8, help="of each pixel (default: 8)"
    )
    options.seed(simulate)
