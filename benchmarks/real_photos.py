"""Blind PSFs of real photos beside published ones, as a table in Markdown.

    OMP_NUM_THREADS=1 python benchmarks/real_photos.py [--methods portfolio variational]
    OMP_NUM_THREADS=1 python benchmarks/real_photos.py --sheet FILE.png [--photos NAME ...]

The photos of ``../shared/data/real`` beside the repository were deblurred by Pan et al. (2014,
2016), who set the size of the PSF by hand; theirs are no truth, but look right. The response is
taken to be sRGB, and the size is not given. Similarity is the greatest normalized cross-correlation
over all shifts; seconds are of CPU, for the PSF alone.

``--sheet`` goes along the whole path with the first method, and draws photo, result and published
result side by side.
"""

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from skimage import io

from napari_crfdeblur import deblur
from napari_crfdeblur.methods import PSFS, named
from napari_crfdeblur.pipeline import DeblurOptions
from napari_crfdeblur.psf import Evidence, as_psf, estimate_psf
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import SRGB
from napari_crfdeblur.response.saturation import clipped_pixels

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "real"
Photo = tuple[str, NDArray[np.uint8], NDArray[np.floating]]


def photos(names: list[str]) -> Iterator[Photo]:
    """Name, photo and published PSF."""
    for path in sorted(DATA.glob("*__published_psf.png")):
        name = path.name.removesuffix("__published_psf.png")
        if not names or name in names:
            photo = next(p for p in DATA.glob(f"{name}.*"))
            yield name, io.imread(photo)[..., :3], as_psf(io.imread(path).astype(float))


def print_row(own: Photo, methods: list[str]) -> list[float]:
    """Similarity of the PSF of each method."""
    name, photo, published = own
    linear = np.asarray(SRGB().to_irradiance(photo / 255), np.float32)
    evidence, cells, found = Evidence(linear, clipped_pixels(photo), certain=False), [], []
    for method in methods:
        start = time.process_time()
        estimate = estimate_psf(evidence, named(PSFS, method).make())
        seconds = time.process_time() - start
        found.append(kernel_similarity(estimate.psf, published))
        cells.append(f"{found[-1]:.2f} {estimate.status.name.lower()} | {seconds:.0f}")
    print(f"| {name} | {max(published.shape)} | {' | '.join(cells)} |", flush=True)
    return found


def draw(chosen: list[Photo], path: Path, method: str) -> None:
    """Photo, our result and the published one, in a row for each."""
    figure = Figure(figsize=(15, 4.2 * len(chosen)), layout="constrained")
    axes = figure.subplots(len(chosen), 3, squeeze=False)
    for row, (name, photo, _) in zip(axes, chosen, strict=True):
        result = deblur(photo, DeblurOptions(psf=named(PSFS, method).make()))
        print(f"{name}: {result.psf.sentence}", flush=True)
        published = io.imread(DATA / f"{name}__published.jpg")
        for panel, picture in zip(row, (photo, result.photo, published), strict=True):
            panel.imshow(picture)
            panel.axis("off")
        row[0].set_title(name)
    figure.savefig(path, dpi=90)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words = [method.word for method in PSFS]
    parser.add_argument("--methods", nargs="+", choices=words, default=["portfolio", "variational"])
    parser.add_argument("--photos", nargs="+", default=[])
    parser.add_argument("--sheet", type=Path)
    options = parser.parse_args()
    chosen = list(photos(options.photos))
    if not chosen:
        sys.exit(f"No photos in {DATA}.")
    if options.sheet:
        draw(chosen, options.sheet, options.methods[0])
        return
    print("| photo | published size | " + " | CPU s | ".join(options.methods) + " | CPU s |")
    print("|---" * (2 + 2 * len(options.methods)) + "|")
    found = np.array([print_row(own, options.methods) for own in chosen])
    for method, own in zip(options.methods, found.T, strict=True):
        print(
            f"\n{method}: {np.sum(own >= 0.75)} of {len(own)} at .75, median {np.median(own):.2f}"
        )


if __name__ == "__main__":
    main()
