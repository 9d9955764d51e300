"""What can be said on the command line; loads nothing but the standard library."""

from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable, Sequence
from pathlib import Path

from .._version import __version__
from . import options
from .kinds import grid, odd, size

FITS = ("likelihood", "rank", "rank-all", "mean", "known-psf")


def parse(argv: Sequence[str] | None) -> Namespace:
    """Read the arguments; on ``--help`` or a mistake, argparse ends the program."""
    parser = ArgumentParser(
        prog="crfdeblur",
        description="Deblur photos in linear light, with the camera response estimated from "
        "the straight edges of the blurred photo itself.",
        epilog="`crfdeblur COMMAND --help` tells the options of a command.",
    )
    parser.add_argument("--version", action="version", version=f"crfdeblur {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for add in (_demo, _deblur, _batch, _estimate, _psf, _simulate):
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
    options.photo(deblur, "PNG, JPEG or TIFF; in tiles NPY and zarr, too")
    options.output(deblur, "FILE", "deblurred photo (default: PHOTO-deblurred beside the photo)")
    options.response(deblur)
    options.cameras(deblur)
    deblur.add_argument(
        "--psf", default="auto", metavar="PSF", help=f"{options.PSF_HELP} (default: auto)"
    )
    options.method(deblur)
    options.psf_size(deblur)
    options.edges(deblur)
    options.report(deblur)
    deblur.add_argument(
        "--varying",
        type=grid,
        nargs="?",
        const=4,
        metavar="ROWSxCOLUMNS",
        help="for a camera that turned: a PSF for each of so many parts of the photo "
        "(default: 4 along the longer side)",
    )
    deblur.add_argument(
        "--tiled",
        action="store_true",
        help="work in tiles, with little memory, on all pages (default: a TIFF of one page "
        "and more than 67 megapixels, and stacks for a PSF of three dimensions)",
    )
    options.scheduler(deblur)


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
        default="each",
        metavar="PSF",
        help="each (every photo has its own), first (that of the first photo for all), one (one "
        "for all, from several photos), or a file (.png, .tif, .npy) (default: each)",
    )
    options.psf_size(batch)
    options.method(batch)
    batch.add_argument(
        "--suffix",
        default="-deblurred",
        metavar="TEXT",
        help="what is added to the name of each photo (default: -deblurred)",
    )
    options.extent(batch)
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
    estimate.add_argument("--psf", type=Path, metavar="FILE", help="the PSF, if it is known")
    options.prior(estimate)
    options.cameras(estimate)
    options.edges(estimate)
    options.report(estimate)


def _psf(add: Add) -> None:
    psf = add(
        "psf",
        "estimate the point spread function of a photo",
        "crfdeblur psf photo.jpg -o psf.png --response srgb",
    )
    options.photo(psf)
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
        help="what the PSF is found from: the picture, by the best method or a named one, or "
        "straight edges alone (default: auto)",
    )
    options.psf_size(psf)
    options.edges(psf)
    options.report(psf)


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
        default="shake",
        metavar="PSF",
        help="shake, kernel-a, kernel-b, line, disk, gaussian, or a file (default: shake)",
    )
    simulate.add_argument(
        "--psf-size",
        type=odd,
        default=21,
        metavar="PIXELS",
        help="extent of the blur (default: 21)",
    )
    simulate.add_argument(
        "--turn",
        type=float,
        default=0.0,
        metavar="DEGREES",
        help="by which the camera turns, too, while it shakes (default: 0)",
    )
    simulate.add_argument(
        "--response",
        default="camera",
        metavar="RESPONSE",
        help="camera (one far from gamma 2.2), gamma:2.2, srgb, identity, or a "
        "response file (default: camera)",
    )
    simulate.add_argument(
        "--size",
        type=size,
        default=(600, 900),
        metavar="ROWSxCOLUMNS",
        help="of the photo (default: 600x900)",
    )
    simulate.add_argument(
        "--noise",
        type=float,
        default=0.002,
        help="standard deviation before the response (default: 0.002)",
    )
    simulate.add_argument(
        "--bits", type=int, choices=(8, 16), default=8, help="of each pixel (default: 8)"
    )
    options.seed(simulate)
