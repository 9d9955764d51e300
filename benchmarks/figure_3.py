"""Fig. 3 of Kim et al. 2012 as a table: blind PSFs with and without linearization.

    OMP_NUM_THREADS=1 python benchmarks/figure_3.py [--cases N] [--keep FOLDER] [--draw FILE.png]
    OMP_NUM_THREADS=1 python benchmarks/figure_3.py --whole [--cases N]

Streets drawn at random and, if they are there, film scans from ``../shared/data/sharp`` beside
the repository, in turns; each blurred by a simulated shake and taken twice, by a linear camera and
by one with a nonlinear response. Of the photo of the linear camera, every method estimates the PSF
as it is; of the other, as it is, after a gamma of 2.2, after the response that is estimated from
the edges of the same photo, and after the true response. All methods are told the size of the PSF,
and the blind ones look at the same part of the picture.

The similarity is the greatest normalized cross-correlation with the true PSF over all shifts. The
PSNR is that of the middle of the picture, restored with each PSF in true linear light, after the
best shift: so it measures the PSF alone. Where a method gives up, no blur is its answer.

``--keep`` stores the PSFs of each case in a folder, and takes from there what is there already;
``--draw`` draws those of the first street and the first scan. ``--whole`` restores whole photos by
``deblur`` instead: with the response and the PSF that it finds, and with the true ones.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from math import radians
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import suites
from matplotlib.figure import Figure
from numpy.typing import NDArray

from napari_crfdeblur import DeblurOptions, deblur
from napari_crfdeblur.deconvolution import HyperLaplacian, deconvolve
from napari_crfdeblur.edges import estimate_blur_extent, find_edges
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import GivenResponse, MaximumLikelihood, estimate_response
from napari_crfdeblur.pipeline import profiles_for
from napari_crfdeblur.profiles import ByOrientation, sample_profiles
from napari_crfdeblur.psf import (
    Evidence,
    Fergus,
    GivenPsf,
    PsfEstimate,
    RadonFit,
    Shan,
    Variational,
    XuJia,
    camera_shake,
    delta,
    estimate_psf,
)
from napari_crfdeblur.quality import kernel_similarity, psnr
from napari_crfdeblur.response import (
    SRGB,
    Emor,
    Gamma,
    GeneralizedGamma,
    Identity,
    ResponseCurve,
    linearize,
)
from napari_crfdeblur.simulate import Camera, Scene, Simulated, simulate, street

Floats: TypeAlias = NDArray[np.floating]
Psfs: TypeAlias = dict[tuple[str, str], Floats]  # by method and response

REGION = 256  # pixels: side of what blind methods look at
ESTIMATORS: dict[str, Callable[[int], Any]] = {
    "Fergus 2006": lambda size: Fergus(size, REGION),
    "Shan 2008": lambda size: Shan(size, REGION),
    "Xu & Jia 2010": lambda size: XuJia(size, REGION),
    "Cho 2011": lambda size: RadonFit(size),
    "Variational": lambda size: Variational(size, REGION),
}
RESPONSES = {
    "strong": GeneralizedGamma((0.85, -0.75, 0.25)),
    "EMoR 2, -.5": Emor((2, -0.5)),
    "sRGB": SRGB(),
    "gamma 1.5": Gamma(1.5),
}
LINEAR = "linear camera"
COLUMNS = (LINEAR, "none", "gamma 2.2", "estimated", "true")
SIZES = 13, 17, 21
SHAPE = 560, 720
MIDDLE = 320  # pixels: side of what is restored
NOISE = 0.002
RESTORATION = HyperLaplacian(model_error=0.01)  # the same strength for all PSFs


@dataclass(frozen=True)
class Case:
    """One picture, one shake, two cameras."""

    number: int

    @property
    def size(self) -> int:
        return SIZES[self.number % len(SIZES)]

    @property
    def response(self) -> str:
        return list(RESPONSES)[self.number // 2 % len(RESPONSES)]

    @property
    def scan(self) -> Path | None:
        """The film scan of an odd number, if there are any."""
        scans = sorted((suites.DATA / "sharp").glob("*.png"))
        return scans[self.number // 2 % len(scans)] if scans and self.number % 2 else None

    def scene(self) -> Scene:
        if self.scan:
            return Scene(suites.linear_light(self.scan))
        rows, columns = (side + self.size - 1 for side in SHAPE)
        return street((rows, columns), seed=self.number)

    def photo(self, curve: ResponseCurve) -> Simulated:
        psf = camera_shake(self.size, self.number + 100)
        return simulate(self.scene(), psf, Camera(curve, noise=NOISE), seed=self.number)

    def __str__(self) -> str:
        picture = f"scan {self.scan.stem}" if self.scan else "street"
        return f"{self.number}: {picture}, {self.response}, {self.size} px"


def estimated(photo: Floats) -> ResponseCurve:
    """The response that the edges of a photo give."""
    method = MaximumLikelihood()
    edges = find_edges(photo, blur_extent=estimate_blur_extent(photo))
    return estimate_response(profiles_for(method, photo, edges), method).curve


def found(photo: Floats, curve: ResponseCurve, method: Any) -> Floats:
    """PSF that a method finds if a response is assumed; no blur if it gives up."""
    try:
        return estimate(photo, curve, method).psf
    except CrfDeblurError:
        return delta()


def estimate(photo: Floats, curve: ResponseCurve, method: Any) -> PsfEstimate:
    if not isinstance(method, RadonFit):
        return estimate_psf(linearize(photo, curve), method)
    edges = find_edges(photo, blur_extent=estimate_blur_extent(photo))
    groups = sample_profiles(photo, edges, grouping=ByOrientation(tolerance=radians(1)))
    return estimate_psf(Evidence(groups=tuple(groups), response=curve), method)


def psfs_of(case: Case, names: list[str]) -> Psfs:
    """PSFs of the named methods and all responses."""
    truth = RESPONSES[case.response]
    straight, bent = case.photo(Identity()).photo, case.photo(truth).photo
    curves = {
        LINEAR: Identity(),
        "none": Identity(),
        "gamma 2.2": Gamma(2.2),
        "estimated": estimated(bent),
        "true": truth,
    }
    return {
        (name, column): found(
            straight if column == LINEAR else bent, curve, ESTIMATORS[name](case.size)
        )
        for name in names
        for column, curve in curves.items()
    }


def kept(case: Case, folder: Path | None) -> Psfs:
    """PSFs of all methods and responses: those in a file, and the others, added to it."""
    path = folder and folder / f"case-{case.number}.npz"
    psfs: Psfs = {}
    if path and path.exists():
        with np.load(path) as stored:
            psfs = {tuple(name.split("/")): stored[name] for name in stored.files}
    missing = [name for name in ESTIMATORS if (name, LINEAR) not in psfs]
    psfs |= psfs_of(case, missing) if missing else {}
    if path and missing:
        np.savez(path, **{"/".join(key): psf for key, psf in psfs.items()})
    return psfs


def restored(case: Case, psfs: Psfs) -> dict[tuple[str, str], float]:
    """PSNR of the middle restored with each PSF in true linear light, dB."""
    shot = case.photo(RESPONSES[case.response])
    light = linearize(shot.photo, RESPONSES[case.response])
    rows, columns = ((side - MIDDLE) // 2 for side in light.shape[:2])
    middle = slice(rows, rows + MIDDLE), slice(columns, columns + MIDDLE)
    blurred, sharp = (picture[middle].mean(axis=2) for picture in (light, shot.sharp_linear))
    every = {**psfs, ("true PSF", "true"): shot.psf, ("no PSF", "true"): delta()}
    return {
        key: psnr(deconvolve(blurred, psf, RESTORATION) if psf.size > 1 else blurred, sharp)
        for key, psf in every.items()
    }


def table(title: str, values: dict[tuple[str, str], list[float]], form: str) -> str:
    """Medians over the cases, a row for each method."""
    rows = [f"| {title} | " + " | ".join(COLUMNS) + " |", "|---" * (len(COLUMNS) + 1) + "|"]
    for name in ESTIMATORS:
        cells = [format(np.median(values[name, column]), form) for column in COLUMNS]
        rows.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join([*rows, ""])


def measure(cases: list[Case], folder: Path | None) -> None:
    similarities: dict[tuple[str, str], list[float]] = {}
    gains: dict[tuple[str, str], list[float]] = {}
    head = " | ".join(f"{name}: {' / '.join(COLUMNS)}" for name in ESTIMATORS)
    print(f"| similarity | {head} |\n" + "|---" * (len(ESTIMATORS) + 1) + "|")
    for case in cases:
        psfs = kept(case, folder)
        truth = case.photo(RESPONSES[case.response]).psf
        for key, psf in psfs.items():
            similarities.setdefault(key, []).append(kernel_similarity(psf, truth))
        for key, value in restored(case, psfs).items():
            gains.setdefault(key, []).append(value)
        cells = (
            " / ".join(f"{similarities[name, column][-1]:.2f}" for column in COLUMNS)
            for name in ESTIMATORS
        )
        print(f"| {case} | " + " | ".join(cells) + " |", flush=True)
    print("\n" + table("similarity, median", similarities, ".3f"))
    print(table("PSNR with the PSF, dB, median", gains, ".2f"))
    known, none = (np.median(gains[name, "true"]) for name in ("true PSF", "no PSF"))
    print(f"{known:.2f} dB with the true PSF, {none:.2f} dB as blurred; {len(cases)} photos")


def measure_whole(cases: list[Case]) -> None:
    """Whole photos, with all that is found and with all that is true."""
    print("| photo | blurred | found | true response and PSF | loss, dB |\n" + "|---" * 5 + "|")
    losses = []
    for case in cases:
        truth = RESPONSES[case.response]
        shot = case.photo(truth)
        known = DeblurOptions(response=GivenResponse(truth), psf=GivenPsf(shot.psf))
        own, best = (
            psnr(deblur(shot.photo, options).photo, shot.sharp)
            for options in (DeblurOptions(), known)
        )
        losses.append(best - own)
        before = psnr(shot.photo, shot.sharp)
        print(f"| {case} | {before:.2f} | {own:.2f} | {best:.2f} | {losses[-1]:.2f} |", flush=True)
    print(f"\nMedian loss {np.median(losses):.2f} dB.")


def draw(cases: list[Case], folder: Path | None) -> Figure:
    """PSFs of all methods and responses, a block for each case."""
    figure = Figure(figsize=(8.6, 1.05 * len(cases) * len(ESTIMATORS) + 0.5), layout="constrained")
    blocks = figure.subfigures(len(cases), 1, squeeze=False)[:, 0]
    for block, case in zip(blocks, cases, strict=True):
        psfs, truth = kept(case, folder), case.photo(RESPONSES[case.response]).psf
        axes = block.subplots(len(ESTIMATORS), len(COLUMNS) + 1)
        block.suptitle(str(case).partition(": ")[2], fontsize=9)
        for ax, column in zip(axes[0], (*COLUMNS, "true PSF"), strict=True):
            ax.set_title(column, fontsize=8)
        for row, name in zip(axes, ESTIMATORS, strict=True):
            row[0].set_ylabel(name, fontsize=8)
            for ax, column in zip(row, (*COLUMNS, "true PSF"), strict=True):
                psf = truth if column == "true PSF" else psfs[name, column]
                ax.imshow(framed(psf, case.size + 8), cmap="gray", interpolation="nearest")
                ax.set(xticks=[], yticks=[])
    return figure


def framed(psf: Floats, side: int) -> Floats:
    """A PSF in the middle of a square, cut where it is larger."""
    square = np.zeros((side, side))
    padded = np.pad(psf, side)
    top, left = (length // 2 - side // 2 for length in padded.shape)
    square[:] = padded[top : top + side, left : left + side]
    return square


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=8, help="number of photos (default: 8)")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="where PSFs are stored")
    parser.add_argument("--draw", type=Path, metavar="FILE", help="draw PSFs instead")
    parser.add_argument("--whole", action="store_true", help="restore whole photos instead")
    options = parser.parse_args()
    cases = [Case(number) for number in range(options.cases)]
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
    if options.whole:
        measure_whole(cases)
    elif options.draw:
        draw(cases[:2], options.keep).savefig(options.draw, dpi=150)
    else:
        measure(cases, options.keep)


if __name__ == "__main__":
    main()
