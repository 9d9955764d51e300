"""The size of a PSF found from the picture, against the one that is known, as a table.

    OMP_NUM_THREADS=1 python benchmarks/psf_size.py [--photos FOLDER]

Crops of sharp photos in linear light are blurred by shakes, straight motion, defocus and
Gaussians of 5 to 43 pixels, with noise of .002 to .01. The extent of the true PSF is that of its
pixels above 2 % of the peak; the size found is that of the array in which the PSF comes back.
Both PSFs, of the size of the true array and of the size that was found, are compared with the
truth. CPU seconds are those of the estimate with either.

The photos are read from ``../shared/data/sharp`` beside the repository.
"""

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from napari_crfdeblur.psf import XuJia, camera_shake, disk, estimate_psf, gaussian, line
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import Gamma, linearize

Array = NDArray[np.floating]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "sharp"
SHAPE = 400, 440
NOISE = 0.002, 0.005, 0.01


def psfs() -> Iterator[tuple[str, Array]]:
    for size in (9, 13, 19, 27, 41):
        yield f"shake, {size}", camera_shake(size, size)
    for size in (9, 15, 27, 41):
        yield f"shake, {size}, another", camera_shake(size, size + 100)
    for radius in (2.5, 5, 8):
        yield f"disk, {2 * radius:g}", disk(radius)
    for sigma in (1.2, 2.5, 4):
        yield f"Gaussian, {sigma:g}", gaussian(sigma)
    for length, angle in ((9, 0.3), (17, 1.2), (31, 2.2), (41, 0.1)):
        yield f"line, {length}", line(length, angle)


def blurred(path: Path, psf: Array, noise: float, number: int) -> Array:
    light = linearize(iio.imread(path)[..., :3], Gamma(2.2))
    top, left = (37 * number) % 60, (91 * number) % 200
    rows, columns = (side + reach for side, reach in zip(SHAPE, psf.shape, strict=True))
    crop = light[top : top + rows, left : left + columns]
    clean = fftconvolve(crop, psf[:, :, np.newaxis], mode="valid", axes=(0, 1))
    rng = np.random.default_rng(number)
    return np.clip(clean + rng.normal(0, noise, clean.shape), 0, 1).astype(np.float32)


def extent(psf: Array) -> int:
    return max(int(np.ptp(axis)) + 1 for axis in np.nonzero(psf > 0.02 * psf.max()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--photos", type=Path, default=DATA)
    paths = sorted(parser.parse_args().photos.glob("*.png"))
    if not paths:
        sys.exit(f"No photos in {DATA}: put sharp photos as PNG there, or name their folder.")
    print("| PSF | noise | extent | size found | likeness, size known | found | CPU s | CPU s |")
    print("|---" * 8 + "|")
    for number, (name, psf) in enumerate(psfs()):
        noise = NOISE[number % len(NOISE)]
        photo = blurred(paths[number % len(paths)], psf, noise, number)
        cells = []
        for method in (XuJia(size=max(psf.shape) | 1), XuJia()):
            start = time.process_time()
            estimate = estimate_psf(photo, method)
            seconds = time.process_time() - start
            cells.append((max(estimate.psf.shape), kernel_similarity(estimate.psf, psf), seconds))
        (_, known, quick), (size, found, slow) = cells
        print(
            f"| {name} | {noise} | {extent(psf)} | {size} | {known:.3f} | {found:.3f} | "
            f"{quick:.1f} | {slow:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
