"""What can be said on the command line; loads nothing but the standard library."""

from argparse import ArgumentParser, ArgumentTypeError, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable, Sequence
from pathlib import Path

from .._version import __version__

RESPONSE_HELP = "auto (estimate it), gamma:2.2, srgb, identity, or a response file (.json)"
PSFS = ("auto", "edges", "variational", "xu-jia", "fergus", "shan")
PSF_HELP = (
    "auto (from the picture), edges (from them alone), variational, xu-jia, fergus, shan (from "
    "the picture by these methods), or a file (.png, .tif, .npy)"
)


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
    demo.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("demo"),
        metavar="FOLDER",
        help="folder for the pictures (default: demo)",
    )
    demo.add_argument("--seed", type=int, default=0, help="draw another scene (default: 0)")


def _deblur(add: Add) -> None:
    deblur = add(
        "deblur",
        "deblur a photo",
        "crfdeblur deblur photo.jpg -o sharp.png --report report.html",
    )
    deblur.add_argument(
        "photo", type=Path, metavar="PHOTO", help="PNG, JPEG or TIFF; in tiles NPY and zarr, too"
    )
    deblur.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="deblurred photo (default: PHOTO-deblurred beside the photo)",
    )
    deblur.add_argument(
        "--response", default="auto", metavar="RESPONSE", help=f"{RESPONSE_HELP} (default: auto)"
    )
    _prior(deblur)
    _cameras(deblur)
    deblur.add_argument("--psf", default="auto", metavar="PSF", help=f"{PSF_HELP} (default: auto)")
    deblur.add_argument(
        "--method",
        choices=METHODS,
        default="local-shrinkage",
        help="deconvolution (default: local-shrinkage)",
    )
    _psf_size(deblur)
    _edges(deblur)
    _report(deblur)
    deblur.add_argument(
        "--varying",
        type=_grid,
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
        "and more than 67 megapixels)",
    )
    _scheduler(deblur)


def _batch(add: Add) -> None:
    batch = add(
        "batch",
        "deblur many photos of one camera; go on where an earlier batch stopped",
        "crfdeblur batch photos/*.jpg -o sharp",
    )
    batch.add_argument("photos", type=Path, nargs="+", metavar="PHOTO", help="PNG, JPEG or TIFF")
    batch.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        metavar="FOLDER",
        help="folder for the deblurred photos and the journal; made if it is missing",
    )
    batch.add_argument(
        "--response",
        default="auto",
        metavar="RESPONSE",
        help=f"of all photos: {RESPONSE_HELP} (default: auto, from the photos together)",
    )
    _prior(batch)
    batch.add_argument(
        "--psf",
        default="each",
        metavar="PSF",
        help="each (every photo has its own), first (that of the first photo for all), one (one "
        "for all, from several photos), or a file (.png, .tif, .npy) (default: each)",
    )
    _psf_size(batch)
    batch.add_argument(
        "--method",
        choices=METHODS,
        default="local-shrinkage",
        help="deconvolution (default: local-shrinkage)",
    )
    batch.add_argument(
        "--suffix",
        default="-deblurred",
        metavar="TEXT",
        help="what is added to the name of each photo (default: -deblurred)",
    )
    _extent(batch)
    _scheduler(batch)


def _estimate(add: Add) -> None:
    estimate = add(
        "estimate",
        "estimate the camera response from one photo or several",
        "crfdeblur estimate one.jpg two.jpg -o camera.json",
    )
    estimate.add_argument(
        "photos",
        type=Path,
        nargs="+",
        metavar="PHOTO",
        help="PNG, JPEG or TIFF; several photos of one camera are pooled",
    )
    estimate.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE.json",
        help="response file for `deblur --response`; without it, only a summary",
    )
    estimate.add_argument(
        "--method",
        choices=FITS,
        default="likelihood",
        help="likelihood, or of the paper: rank (Eq. 10), rank-all (Eq. 8), mean (Eq. 5), "
        "known-psf (Eq. 4) (default: likelihood)",
    )
    estimate.add_argument("--psf", type=Path, metavar="FILE", help="the PSF, if it is known")
    _prior(estimate)
    _cameras(estimate)
    _edges(estimate)
    _report(estimate)


def _psf(add: Add) -> None:
    psf = add(
        "psf",
        "estimate the point spread function of a photo",
        "crfdeblur psf photo.jpg -o psf.png --response srgb",
    )
    psf.add_argument("photo", type=Path, metavar="PHOTO", help="PNG, JPEG or TIFF")
    psf.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="PSF as .png, .tif or .npy (default: PHOTO-psf.png beside the photo)",
    )
    psf.add_argument(
        "--response", default="auto", metavar="RESPONSE", help=f"{RESPONSE_HELP} (default: auto)"
    )
    _prior(psf)
    _cameras(psf)
    psf.add_argument(
        "--from",
        dest="psf",
        choices=PSFS,
        default="auto",
        help="what the PSF is found from: the picture, by the best method or a named one, or "
        "straight edges alone (default: auto)",
    )
    _psf_size(psf)
    _edges(psf)
    _report(psf)


def _simulate(add: Add) -> None:
    simulate = add(
        "simulate",
        "make a blurred photo whose truth is known",
        "crfdeblur simulate -o blurred.png --scene street --psf shake --response gamma:2.2",
    )
    simulate.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("simulated.png"),
        metavar="FILE",
        help="blurred photo (default: simulated.png); the sharp "
        "photo, the PSF and the response are written beside it",
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
        type=_odd,
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
        type=_size,
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
    simulate.add_argument("--seed", type=int, default=0, help="draw another scene (default: 0)")


METHODS = (
    "local-shrinkage",
    "hyper-laplacian",
    "irls",
    "total-variation",
    "richardson-lucy",
    "wiener",
)
FITS = ("likelihood", "rank", "rank-all", "mean", "known-psf")


def _prior(command: ArgumentParser) -> None:
    command.add_argument(
        "--prior",
        metavar="KIND",
        help="what is assumed of a camera of which nothing is stored: digital, dorf (film and "
        "digital), srgb, or a response file of it or one like it (default: digital)",
    )


def _cameras(command: ArgumentParser) -> None:
    command.add_argument(
        "--cameras",
        type=Path,
        metavar="FOLDER",
        help="stored cameras: start from what other photos have told of this one",
    )
    command.add_argument(
        "--camera",
        type=_name,
        metavar="NAME",
        help="name of the camera, with --cameras (default: what the photo says)",
    )


def _psf_size(command: ArgumentParser) -> None:
    command.add_argument(
        "--psf-size",
        type=_odd,
        metavar="PIXELS",
        help="largest extent of the PSF (default: found from the picture)",
    )


def _edges(command: ArgumentParser) -> None:
    command.add_argument(
        "--edges", type=Path, metavar="FILE", help="edges to use (.json) instead of finding them"
    )
    command.add_argument(
        "--save-edges",
        type=Path,
        metavar="FILE",
        help="write the edges that were found (.json, or .csv for a spreadsheet)",
    )
    _extent(command)


def _extent(command: ArgumentParser) -> None:
    command.add_argument(
        "--blur-extent",
        type=_positive,
        metavar="PIXELS",
        help="largest width of a blurred edge (default: judged from the photo)",
    )
    command.add_argument(
        "--per-channel",
        action="store_true",
        help="one response for each color channel instead of one for all",
    )


def _scheduler(command: ArgumentParser) -> None:
    command.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="let the workers of a dask.distributed cluster do the work, such as tcp://host:8786",
    )


def _report(command: ArgumentParser) -> None:
    command.add_argument(
        "--report",
        type=Path,
        metavar="FILE",
        help="write a page that shows what was found (.html or .png)",
    )


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise ArgumentTypeError(f"expected a positive number, got {text}")
    return value


def _name(text: str) -> str:
    name = " ".join(text.split())
    if not name:
        raise ArgumentTypeError("expected the name of a camera, got none")
    return name


def _odd(text: str) -> int:
    """A size in pixels, at least 3; an even one becomes the next odd one."""
    if not text.isdigit() or int(text) < 3:
        raise ArgumentTypeError(f"expected a whole number of pixels, at least 3, got {text}")
    return int(text) | 1


def _size(text: str) -> tuple[int, int]:
    rows, _, columns = text.partition("x")
    if not (rows.isdigit() and columns.isdigit() and min(int(rows), int(columns)) >= 64):
        raise ArgumentTypeError(f"expected ROWSxCOLUMNS of at least 64 each, got {text}")
    return int(rows), int(columns)


def _grid(text: str) -> tuple[int, int]:
    rows, _, columns = text.partition("x")
    if not (rows.isdigit() and columns.isdigit() and int(rows) and int(columns)):
        raise ArgumentTypeError(f"expected ROWSxCOLUMNS of parts, got {text}")
    return int(rows), int(columns)
