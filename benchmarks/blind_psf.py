"""Blind estimation of PSFs on the photos of Levin et al. (2009), as a table in Markdown.

    OMP_NUM_THREADS=1 python benchmarks/blind_psf.py [--scale 1.5] [--kernels FILE.png]
    OMP_NUM_THREADS=1 python benchmarks/blind_psf.py --edges

Each photo was really blurred by camera shake, and its sharp version and PSF are known. Both
PSFs, estimated and true, restore the photo by the same method, and the restored pictures are
shifted onto the sharp one, by the best quarter of a pixel. The error ratio is the sum of squared
differences with the estimated PSF over that with the true one, without a border of 25 pixels;
up to 2 the restored picture usually looks right. The similarity of PSFs is their greatest
normalized cross-correlation over all shifts. Seconds are of CPU, for the estimate alone.

The data are read from ``../shared/data/levin2009`` beside the repository. ``--scale`` gives the
method a size that is so many times that of the true PSF; ``--kernels`` draws all PSFs.

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
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy import ndimage
from scipy.io import loadmat

from napari_crfdeblur.deconvolution import HyperLaplacian, deconvolve
from napari_crfdeblur.profiles import ProfileGroup
from napari_crfdeblur.psf import (
    PsfEstimate,
    XuJia,
    camera_shake,
    disk,
    estimate_psf,
    estimate_psf_from_profiles,
    kernel_b,
    line,
    project,
)
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import Gamma
from napari_crfdeblur.simulate import Camera
from napari_crfdeblur.simulate.profiles import any_levels, recorded

Array = NDArray[np.floating]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "levin2009"
BORDER = 25
REACH = 8  # pixels of shift that are tried: some photos are 4 pixels off, and so are PSFs
QUARTERS = np.arange(-3, 4) / 4
# As the pipeline restores with blind PSFs. It is near the best for the true PSFs, too: .005
# gives 33.7 dB, .01 33.6 dB and .015 32.3 dB; the more weight, the smaller the error ratio.
RESTORATION = HyperLaplacian(model_error=0.01)


@dataclass(frozen=True)
class Case:
    name: str
    sharp: Array
    blurred: Array
    psf: Array


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


def score(case: Case, scale: float) -> Score:
    size = int(scale * max(case.psf.shape)) // 2 * 2 + 1
    start = time.process_time()
    estimate = estimate_psf(case.blurred, XuJia(size=size))
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


def print_summary(scores: list[Score]) -> None:
    ratios = np.array([s.ratio for s in scores])
    print(
        f"\nError ratio <= 2: {np.sum(ratios <= 2)} of {len(ratios)}; median "
        f"{np.median(ratios):.2f}; mean PSNR {np.mean([s.psnr for s in scores]):.2f} dB, "
        f"{np.mean([s.best for s in scores]):.2f} dB with the true PSF; mean similarity "
        f"{np.mean([s.similarity for s in scores]):.3f}; mean CPU "
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
            estimate = estimate_psf_from_profiles(groups, CURVE)
            longest = max(longest, time.process_time() - start)
            status = estimate.status.name.lower()
            cells.append(f"{kernel_similarity(estimate.psf, psf):.3f} {status}")
        print(f"| {name} | " + " | ".join(cells) + f" | {longest:.1f} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--kernels", type=Path)
    parser.add_argument("--edges", action="store_true")
    options = parser.parse_args()
    if options.edges:
        print_edges()
        return
    known = list(cases())
    if not known:
        sys.exit(f"No photos in {DATA}: put the .mat files of Levin et al. (2009) there.")
    print("| photo | error ratio | PSNR | with true PSF | similarity | CPU s | status | figures |")
    print("|---|---|---|---|---|---|---|---|")
    scores = []
    for case in known:
        scores.append(score(case, options.scale))
        print_row(scores[-1])
    print_summary(scores)
    if options.kernels:
        pairs = [(c.psf, s.estimate.psf) for c, s in zip(known, scores, strict=True)]
        draw(pairs, options.kernels)


if __name__ == "__main__":
    main()
