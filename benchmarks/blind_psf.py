"""Blind estimation of PSFs on the photos of Levin et al. (2009), as a table in Markdown.

    OMP_NUM_THREADS=1 python benchmarks/blind_psf.py [--method shan] [--scale 1.5]
    OMP_NUM_THREADS=1 python benchmarks/blind_psf.py --kernels FILE.png
    OMP_NUM_THREADS=1 python benchmarks/blind_psf.py --simulated [--method xu-jia]
    OMP_NUM_THREADS=1 python benchmarks/blind_psf.py --streets [--method xu-jia] [--count 20]
    OMP_NUM_THREADS=1 python benchmarks/blind_psf.py --edges

Each photo was really blurred by camera shake, and its sharp version and PSF are known. Both
PSFs, estimated and true, restore the photo by the same method, and the restored pictures are
shifted onto the sharp one, by the best quarter of a pixel. The error ratio is the sum of squared
differences with the estimated PSF over that with the true one, without a border of 25 pixels;
up to 2 the restored picture usually looks right. The similarity of PSFs is their greatest
normalized cross-correlation over all shifts. Seconds are of CPU, for the estimate alone.

The data are read from ``../shared/data/levin2009`` beside the repository. ``--scale`` gives the
method a size that is so many times that of the true PSF; ``--kernels`` draws all PSFs.

``--simulated`` takes sharp pictures instead, and blurs them: one of 486 x 486 pixels by a PSF of
27 x 27 with noise of .01, then crops of 290 x 290 pixels of ``../shared/data/sharp`` by shakes
and, every fifth, by defocus, with noise of .002 to .01.

``--streets`` blurs streets drawn at random, 286 x 286 pixels of each, recorded with 8 bits, by
shakes and, every fourth, by defocus, with the same noise. Their sharp edges are crisp, which those
of photos are not. It needs no data. Streets of even and of odd numbers are summed up apart: what
was chosen with the former is reported on the latter.

The methods ``radon-map`` and ``radon-fit`` look at the straight edges that are found in the same
part of the photo, in color, with the true response, which is linear; a picture without any is
left out for ``radon-fit``.

``--edges`` measures the PSFs that straight edges alone give instead, on profiles simulated from
known PSFs: orientations all round, three profiles of each, a gamma of 2.2, noise as a share of
full scale. It needs no data.
"""

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import radians
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy import ndimage
from scipy.io import loadmat
from scipy.signal import fftconvolve
from skimage import color, data, io

from napari_crfdeblur.deconvolution import HyperLaplacian, deconvolve
from napari_crfdeblur.edges import find_edges
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.profiles import ByOrientation, ProfileGroup, sample_profiles
from napari_crfdeblur.psf import (
    Evidence,
    Fergus,
    L0Gradient,
    MinimalPixels,
    Portfolio,
    PsfEstimate,
    RadonFit,
    RadonMap,
    Shan,
    Variational,
    XuJia,
    camera_shake,
    disk,
    estimate_psf,
    kernel_b,
    line,
    project,
)
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import Gamma, Identity
from napari_crfdeblur.simulate import Camera, simulate, street
from napari_crfdeblur.simulate.profiles import any_levels, recorded

Array = NDArray[np.floating]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "levin2009"
METHODS = {
    "portfolio": Portfolio,
    "l0-gradient": L0Gradient,
    "minimal-pixels": MinimalPixels,
    "variational": Variational,
    "xu-jia": XuJia,
    "fergus": Fergus,
    "shan": Shan,
    "radon-map": RadonMap,
    "radon-fit": RadonFit,
}
HEAD = (
    "| photo | error ratio | PSNR | with true PSF | similarity | CPU s | status | figures |\n"
    "|---|---|---|---|---|---|---|---|"
)
BORDER = 25
CROP, EXTENTS, NOISES = 290, (15, 21, 11, 27, 19, 25, 17), (0.002, 0.005, 0.01)
STREETS, STREET, STREET_SIDE = 10, (480, 600), 286
REACH = 8  # pixels of shift that are tried: some photos are 4 pixels off, and so are PSFs
QUARTERS = np.arange(-3, 4) / 4
# The same strength for all PSFs, so that nothing else differs. It is near the best for the true
# ones: .005 gives 33.7 dB, .01 33.6 dB and .015 32.3 dB; the more, the smaller the error ratio.
RESTORATION = HyperLaplacian(model_error=0.01)


@dataclass(frozen=True)
class Case:
    name: str
    sharp: Array
    blurred: Array
    psf: Array
    photo: NDArray[np.generic] | None = None  # in color, for its edges


@dataclass(frozen=True)
class Score:
    name: str
    ratio: float
    psnr: float
    best: float
    similarity: float
    seconds: float
    estimate: PsfEstimate


def cases() -> Iterator[Case]:
    for path in sorted(DATA.glob("*.mat")):
        values = loadmat(path)
        # the files hold the PSF turned by half a turn
        psf = values["f"][::-1, ::-1]
        yield Case(path.stem, values["x"], values["y"].astype(np.float32), psf)


def photographed(name: str, scene: Array, psf: Array, noise: float, seed: int) -> Case:
    """The part of a scene of which all light is known, blurred, with noise."""
    clean = fftconvolve(scene, psf, mode="valid")
    top, left = (side - 1 - side // 2 for side in psf.shape)
    sharp = scene[top : top + clean.shape[0], left : left + clean.shape[1]]
    taken = clean + np.random.default_rng(seed).normal(0, noise, clean.shape)
    return Case(f"{name}, noise {noise:g}", sharp, taken.astype(np.float32), psf)


def simulated() -> Iterator[Case]:
    if (DATA / "im01_ker04.mat").exists():
        psf = np.rot90(loadmat(DATA / "im01_ker04.mat")["f"], 2)
        yield photographed("camera, PSF 4", data.camera() / 255, psf / psf.sum(), 0.01, 0)
    for number, path in enumerate(sorted((DATA.parent / "sharp").glob("*.png"))):
        scene, random = color.rgb2gray(io.imread(path)), np.random.default_rng(2000 + number)
        top, left = (int(random.integers(0, side - CROP)) for side in scene.shape)
        extent, noise = EXTENTS[number % len(EXTENTS)], NOISES[number % len(NOISES)]
        defocus = number % 5 == 4
        psf = disk(extent / 5) if defocus else camera_shake(extent, seed=900 + number)
        name = f"{path.stem}, {'defocus' if defocus else 'shake'} of {max(psf.shape)}"
        crop = scene[top : top + CROP, left : left + CROP]
        yield photographed(name, crop, psf, noise, number)


def streets(count: int) -> Iterator[Case]:
    for number in range(count):
        extent, noise = EXTENTS[number % len(EXTENTS)], NOISES[number % len(NOISES)]
        defocus = number % 4 == 3
        psf = disk(extent / 5) if defocus else camera_shake(extent, seed=700 + number)
        shot = simulate(
            street(STREET, seed=800 + number), psf, Camera(Identity(), noise=noise), seed=number
        )
        random = np.random.default_rng(3000 + number)
        corner = [int(random.integers(0, side - STREET_SIDE)) for side in shot.photo.shape[:2]]
        part = tuple(slice(start, start + STREET_SIDE) for start in corner)
        name = f"street {number}, {'defocus' if defocus else 'shake'} of {max(psf.shape)}"
        light = (shot.photo[part].mean(axis=2) / 255).astype(np.float32)
        sharp = shot.sharp_linear[part].mean(axis=2)
        yield Case(f"{name}, noise {noise:g}", sharp, light, psf, shot.photo[part])


def squared_error(restored: Array, sharp: Array) -> float:
    """Sum of squared differences after the best shift."""
    whole = min(
        product(range(-REACH, REACH + 1), repeat=2),
        key=lambda shift: inner_error(np.roll(restored, shift, axis=(0, 1)), sharp),
    )
    shifts = np.array(whole) + np.array(list(product(QUARTERS, repeat=2)))
    return min(inner_error(ndimage.shift(restored, s, mode="nearest"), sharp) for s in shifts)


def inner_error(picture: Array, sharp: Array) -> float:
    inside = (slice(BORDER, -BORDER),) * 2
    return float(np.sum((picture[inside] - sharp[inside]) ** 2))


def decibels(error: float, shape: tuple[int, ...]) -> float:
    pixels = np.prod([side - 2 * BORDER for side in shape])
    return float(-10 * np.log10(error / pixels))


def seen(case: Case, needs_edges: bool) -> Evidence:
    """The picture, and the profiles of its edges if a method needs them."""
    if not needs_edges:
        return Evidence(case.blurred)
    photo = case.blurred if case.photo is None else case.photo
    edges = find_edges(photo, blur_extent=max(case.psf.shape))
    groups = sample_profiles(photo, edges, grouping=ByOrientation(tolerance=radians(1)))
    return Evidence(case.blurred, groups=tuple(groups), response=Identity())


def score(case: Case, scale: float, method: str) -> Score:
    size = int(scale * max(case.psf.shape)) // 2 * 2 + 1
    start = time.process_time()
    evidence = seen(case, METHODS[method].needs_edges)
    estimate = estimate_psf(evidence, METHODS[method](size=size))
    seconds = time.process_time() - start
    with_estimate, with_truth = (
        squared_error(deconvolve(case.blurred, psf, RESTORATION), case.sharp)
        for psf in (estimate.psf, case.psf)
    )
    return Score(
        name=case.name,
        ratio=with_estimate / with_truth,
        psnr=decibels(with_estimate, case.sharp.shape),
        best=decibels(with_truth, case.sharp.shape),
        similarity=kernel_similarity(estimate.psf, case.psf),
        seconds=seconds,
        estimate=estimate,
    )


def print_row(s: Score) -> None:
    figures = " ".join(f"{v:.3f}" for v in s.estimate.diagnostics.values())
    print(
        f"| {s.name} | {s.ratio:.2f} | {s.psnr:.2f} | {s.best:.2f} | {s.similarity:.3f} "
        f"| {s.seconds:.2f} | {s.estimate.status.name} | {figures} |",
        flush=True,
    )


def print_summary(scores: list[Score], which: str = "") -> None:
    ratios = np.array([s.ratio for s in scores])
    print(
        f"\n{which}Error ratio <= 2: {np.sum(ratios <= 2)} of {len(ratios)}; median "
        f"{np.median(ratios):.2f}; mean PSNR {np.mean([s.psnr for s in scores]):.2f} dB, "
        f"{np.mean([s.best for s in scores]):.2f} dB with the true PSF; mean similarity "
        f"{np.mean([s.similarity for s in scores]):.3f}, median "
        f"{np.median([s.similarity for s in scores]):.3f}; mean CPU "
        f"{np.mean([s.seconds for s in scores]):.2f} s."
    )


def draw(pairs: list[tuple[Array, Array]], path: Path) -> None:
    """True PSFs above the estimated ones."""
    figure = Figure(figsize=(1.2 * len(pairs), 2.6), layout="constrained")
    axes = figure.subplots(2, len(pairs), squeeze=False)
    for column, pair in enumerate(pairs):
        for row, psf in enumerate(pair):
            axes[row, column].imshow(psf, cmap="gray")
            axes[row, column].axis("off")
    figure.savefig(path)


CURVE = Gamma(2.2)
SHAPES = {
    "shake, 15": camera_shake(15, 8),
    "shake, 27": camera_shake(27, 5),
    "bend, 17": kernel_b(),
    "line, 17": line(17, 0.5),
    "disk, 12": disk(6),
}
CONDITIONS = ((24, 0.0), (24, 0.003), (24, 0.01), (8, 0.003), (4, 0.003), (2, 0.003))


def simulated_profiles(psf: Array, orientations: int, noise: float) -> list[ProfileGroup]:
    """Three profiles of each orientation, up to 2 pixels beside their places."""
    rng = np.random.default_rng(orientations)
    camera = Camera(CURVE, noise=noise)
    reach = round(0.75 * max(psf.shape)) + 3
    position = np.arange(-reach, reach + 1)
    groups = []
    for angle in (np.arange(orientations) + 0.3) * np.pi / orientations:
        sides = any_levels(rng, 3)
        sides = np.where(rng.random((3, 1)) < 0.5, sides[:, ::-1], sides)
        places = rng.uniform(-2, 2) + rng.normal(0, 0.1, 3)
        spread = np.stack([project(psf, angle, position - place) for place in places])
        light = sides[:, :1] + np.diff(sides, axis=1) * spread
        groups.append(recorded(light, sides, camera, rng, orientation=float(angle)))
    return groups


def print_edges() -> None:
    """Similarity of the PSFs from edges alone, by orientations and noise."""
    titles = [f"{count}, noise {noise:g}" for count, noise in CONDITIONS]
    print("| PSF | " + " | ".join(titles) + " | longest CPU s |")
    print("|---" * (len(CONDITIONS) + 2) + "|")
    for name, psf in SHAPES.items():
        cells, longest = [], 0.0
        for orientations, noise in CONDITIONS:
            groups = simulated_profiles(psf, orientations, noise)
            start = time.process_time()
            estimate = estimate_psf(Evidence(groups=tuple(groups), response=CURVE), RadonFit())
            longest = max(longest, time.process_time() - start)
            status = estimate.status.name.lower()
            cells.append(f"{kernel_similarity(estimate.psf, psf):.3f} {status}")
        print(f"| {name} | " + " | ".join(cells) + f" | {longest:.1f} |", flush=True)


def print_streets(options: argparse.Namespace) -> None:
    """A row for each street; then the sums of both halves."""
    print(HEAD)
    halves: tuple[list[Score], list[Score]] = ([], [])
    for number, case in enumerate(streets(options.count)):
        try:
            scored = score(case, options.scale, options.method)
        except CrfDeblurError as error:
            print(f"| {case.name} | {error} |")
            continue
        print_row(scored)
        halves[number % 2].append(scored)
    for half, which in zip(halves, ("Even numbers. ", "Odd numbers. "), strict=True):
        if half:
            print_summary(half, which)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--method", choices=METHODS, default="variational")
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--kernels", type=Path)
    parser.add_argument("--simulated", action="store_true")
    parser.add_argument("--streets", action="store_true")
    parser.add_argument("--count", type=int, default=STREETS)
    parser.add_argument("--edges", action="store_true")
    options = parser.parse_args()
    if options.edges:
        print_edges()
        return
    if options.streets:
        print_streets(options)
        return
    known = list(simulated() if options.simulated else cases())
    if not known:
        sys.exit(f"No photos in {DATA}: put the .mat files of Levin et al. (2009) there.")
    print(HEAD)
    scores = []
    for case in known:
        scores.append(score(case, options.scale, options.method))
        print_row(scores[-1])
    print_summary(scores)
    if options.kernels:
        pairs = [(c.psf, s.estimate.psf) for c, s in zip(known, scores, strict=True)]
        draw(pairs, options.kernels)


if __name__ == "__main__":
    main()
