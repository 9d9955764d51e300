"""Whether a slight blur is undone without harm, as a table in Markdown.

Pictures of a linear camera, blurred by Gaussians of known width and with known noise, are restored
with the true PSF and all defaults. The gain is the error of the blurred picture less that of the
restored one, in decibels, over the frame without a border of one PSF side. Shown are the mean and
the least of the pictures. The pictures are those of ``../shared/data/sharp`` beside the repository
in two halves: constants were chosen on the first, results are those of the second.

Run it with one thread::

    OMP_NUM_THREADS=1 python benchmarks/slight_blur.py           # the second half
    OMP_NUM_THREADS=1 python benchmarks/slight_blur.py --chosen  # the first half
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from skimage import color, data, io

from napari_crfdeblur.deconvolution import deconvolve
from napari_crfdeblur.pipeline import DEFAULT_METHOD
from napari_crfdeblur.psf import as_psf, gaussian

Plane = NDArray[np.floating]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "sharp"
WIDTHS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)  # standard deviations, pixels
NOISES = (0.001, 0.002, 0.005, 0.01, 0.02)
SIDE = 384


def pictures(chosen: bool) -> dict[str, Plane]:
    """Gray pictures, by name: every second of those that there are."""
    paths = sorted(DATA.glob("*.png"))[0 if chosen else 1 :: 2]
    found = {path.stem: color.rgb2gray(io.imread(path)) for path in paths}
    whole = found or {"camera": data.camera() / 255.0}
    return {name: np.asarray(each[64:, 64:][:SIDE, :SIDE]) for name, each in whole.items()}


def blurred(sharp: Plane, psf: Plane, noise: float, seed: int) -> Plane:
    """What a linear camera records; all light that reaches the frame is known."""
    from scipy.signal import fftconvolve

    light = fftconvolve(np.pad(sharp, 16, mode="reflect"), psf, mode="same")[16:-16, 16:-16]
    light += np.random.default_rng(seed).normal(0, noise, light.shape)
    return np.asarray(light.clip(0, 1), dtype=np.float32)


def decibels(plane: Plane, sharp: Plane, border: int) -> float:
    inside = (slice(border, -border),) * 2
    return float(-10 * np.log10(np.mean((plane.clip(0, 1) - sharp)[inside] ** 2)))


def gain(sharp: Plane, width: float, noise: float, seed: int) -> float:
    psf = as_psf(gaussian(width))
    photo = blurred(sharp, psf, noise, seed)
    restored = deconvolve(photo, psf, DEFAULT_METHOD)
    border = psf.shape[0]
    return decibels(restored, sharp, border) - decibels(photo, sharp, border)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--chosen", action="store_true", help="on the half that served for tuning")
    scenes = pictures(parser.parse_args().chosen)
    print(f"Gain in dB, mean (least), {DEFAULT_METHOD}: {', '.join(scenes)}\n")
    print("| width, px |" + "".join(f" noise {noise} |" for noise in NOISES))
    print("|---|" + "---|" * len(NOISES))
    for width in WIDTHS:
        cells = []
        for noise in NOISES:
            gains = [gain(each, width, noise, seed) for seed, each in enumerate(scenes.values())]
            cells.append(f" {np.mean(gains):+.2f} ({min(gains):+.2f}) |")
        print(f"| {width} |" + "".join(cells), flush=True)


if __name__ == "__main__":
    main()
