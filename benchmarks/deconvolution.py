"""Quality, speed and memory of the deconvolution methods, as three tables in Markdown.

Run it with one thread, so that CPU seconds compare::

    OMP_NUM_THREADS=1 python benchmarks/deconvolution.py            # 1 megapixel
    OMP_NUM_THREADS=1 python benchmarks/deconvolution.py --large    # and 12 megapixels

Quality is measured on pictures of 512 x 512 pixels, of which the blurred picture shows the
part where all light is known, with noise of .01 and the true PSF: in decibels over the full
frame and over the interior, one PSF side from the border. Pictures and PSFs are taken from
``../shared/data`` beside the repository if it is there, else from scikit-image and made up.
scikit-image is given its best of several settings, chosen by looking at the truth, and each of
its functions is shown as shipped and with edges padded by two PSF sides; ours run as shipped.

Speed is in CPU seconds and as a ratio to the transforms that a method cannot do without, each
timed as half of the best ``rfft2`` + ``irfft2`` pair at the padded size. Where numba is
installed, the methods with compiled loops are timed with them, too, after a first run that
compiles. Memory is the peak of what numpy allocates, in planes of the picture's size, the result
included and the input not.

Highlights are measured on the same pictures in linear light with twelve lamps, 3 to 40 times as
bright as what the camera records: the error is that of the picture clipped to its range, within
one PSF side of saturated pixels but outside of lamps, and over the full frame.
"""

import argparse
import time
import tracemalloc
from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage
from scipy.io import loadmat
from scipy.signal import fftconvolve
from skimage import color, data, io, restoration

from napari_crfdeblur.boundary import periodic_shape
from napari_crfdeblur.deconvolution import (
    Deconvolver,
    HyperLaplacian,
    LocalShrinkage,
    RichardsonLucy,
    SparseIrls,
    Tiled,
    TotalVariation,
    Wiener,
    deconvolve,
    loops,
)

Plane = NDArray[np.floating]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
NOISE = 0.01
SIZES = {"1 Mpx": (1000, 1000), "12 Mpx": (3000, 4000)}
BALANCES = (0.01, 0.03, 0.1, 0.3)  # of scikit-image's wiener

# transforms (half a pair each) that remain when everything else costs nothing: the PSF's and
# the plane's, then those of every step
TRANSFORMS: dict[Deconvolver, int] = {
    Wiener(): 2 + 1,
    RichardsonLucy(): 1 + 30 * 4,
    HyperLaplacian(): 2 + 6 * 2,
    LocalShrinkage(): 2 + 6 * 2,
    TotalVariation(): 2 + 20 * 2,
    SparseIrls(): 2 + 2 + 4 * (2 + 4 * 4),
}
TILED = Tiled(RichardsonLucy())  # for speed and memory only: its tiles overlap
COMPILED = (RichardsonLucy, HyperLaplacian, LocalShrinkage, TotalVariation, Tiled)


def picture(name: str) -> Plane:
    path = DATA / "sharp" / f"{name}.png"
    whole = color.rgb2gray(io.imread(path)) if path.exists() else data.camera() / 255.0
    left = (whole.shape[1] - 512) // 2
    return np.asarray(whole[:512, left : left + 512], dtype=float)


def kernel(number: int) -> Plane:
    path = DATA / "levin2009" / f"im01_ker{number:02d}.mat"
    if path.exists():
        psf = np.rot90(loadmat(path)["f"], 2).astype(float)
    else:
        walk = np.random.default_rng(number).normal(size=(2, 400)).cumsum(axis=1).cumsum(axis=1)
        walk = 8 * walk / np.abs(walk - walk.mean(axis=1, keepdims=True)).max()
        hits = np.histogram2d(*(walk - walk.mean(axis=1, keepdims=True)), bins=np.arange(-9, 9))
        psf = ndimage.gaussian_filter(hits[0], 0.5)
    return psf / psf.sum()


def photograph(scene: Plane, psf: Plane) -> tuple[Plane, Plane]:
    blurred = fftconvolve(scene, psf, mode="valid")
    top, left = ((side - 1) - side // 2 for side in psf.shape)
    sharp = scene[top : top + blurred.shape[0], left : left + blurred.shape[1]]
    blurred += np.random.default_rng(0).normal(0, NOISE, blurred.shape)
    return sharp, blurred.astype(np.float32)


def decibels(truth: Plane, found: Plane, margin: int = 0) -> float:
    inside = np.s_[margin : truth.shape[0] - margin, margin : truth.shape[1] - margin]
    return float(-10 * np.log10(np.mean((truth[inside] - found[inside]) ** 2)))


def padded(restore: Callable[[Plane, Plane], Plane]) -> Callable[[Plane, Plane], Plane]:
    def run(plane: Plane, psf: Plane) -> Plane:
        pad = 2 * max(psf.shape)
        return restore(np.pad(plane, pad, mode="edge"), psf)[pad:-pad, pad:-pad]

    return run


def peers() -> dict[str, list[Callable[[Plane, Plane], Plane]]]:
    """Functions of scikit-image by name, each with its settings to choose from."""
    wiener = [
        lambda y, k, b=balance: restoration.wiener(y, k.astype(y.dtype), b, clip=False)
        for balance in BALANCES
    ]
    lucy = [
        lambda y, k, n=n: restoration.richardson_lucy(np.maximum(y, 0), k, n, clip=False)
        for n in (5, 10, 20, 30)
    ]
    return {
        "scikit-image wiener, as shipped": list(wiener),
        "scikit-image wiener, padded": [padded(each) for each in wiener],
        "scikit-image richardson_lucy, as shipped": list(lucy),
        "scikit-image richardson_lucy, padded": [padded(each) for each in lucy],
    }


def cases() -> Iterator[tuple[str, Plane, Plane]]:
    yield "camera, PSF 4", data.camera() / 255.0, kernel(4)
    if DATA.exists():
        for name, number in (("kodim01", 4), ("kodim07", 2), ("kodim15", 6), ("kodim23", 5)):
            yield f"{name}, PSF {number}", picture(name), kernel(number)
    else:
        yield "moon, PSF 7", data.moon() / 255.0, kernel(7)


def quality() -> None:
    columns: dict[str, list[str]] = {}
    names = []
    for name, scene, psf in cases():
        names.append(name)
        sharp, blurred = photograph(scene, psf)
        margin = max(psf.shape)
        found = {"blurred": blurred}
        for peer, settings in peers().items():
            candidates = [restore(blurred, psf) for restore in settings]
            found[peer] = max(candidates, key=lambda each: decibels(sharp, each))
        for method in TRANSFORMS:
            found[type(method).__name__] = deconvolve(blurred, psf, method)
        for method_name, restored in found.items():
            both = f"{decibels(sharp, restored):.2f} / {decibels(sharp, restored, margin):.2f}"
            columns.setdefault(method_name, []).append(both)
    print("\nPSNR, full / interior, dB\n")
    table(["", *names], [[method, *row] for method, row in columns.items()])


def with_lamps(scene: Plane, seed: int) -> Plane:
    """The scene in linear light, darker, with a dozen disks that saturate the camera."""
    rng = np.random.default_rng(seed)
    light = 0.6 * scene**2.2
    rows, columns = np.indices(scene.shape)
    for _ in range(12):
        row, column = (rng.uniform(40, side - 40) for side in scene.shape)
        radius = rng.uniform(1.5, 7)
        light[(rows - row) ** 2 + (columns - column) ** 2 < radius**2] = rng.uniform(3, 40)
    return light


def highlights() -> None:
    columns: dict[str, list[str]] = {}
    names = []
    for seed, (name, scene, psf) in enumerate(cases()):
        names.append(name)
        sharp, blurred = photograph(with_lamps(scene, seed), psf)
        clipped = blurred >= 1
        recorded = np.minimum(blurred, np.float32(1))
        near = ndimage.binary_dilation(clipped, iterations=max(psf.shape)) & (sharp < 1)
        found = {"blurred": recorded}
        for method in TRANSFORMS:
            kind = type(method).__name__
            found[kind] = deconvolve(recorded, psf, method)
            found[f"{kind}, clipped pixels told"] = deconvolve(
                recorded, psf, method, clipped=clipped
            )
        for method_name, restored in found.items():
            error = (np.clip(restored, 0, 1) - np.clip(sharp, 0, 1)) ** 2
            both = [-10 * np.log10(each.mean()) for each in (error[near], error)]
            columns.setdefault(method_name, []).append(f"{both[0]:.2f} / {both[1]:.2f}")
    print("\nHighlights: PSNR around them / full frame, dB\n")
    table(["", *names], [[method, *row] for method, row in columns.items()])


def seconds(work: Callable[[], object], repeat: int = 1) -> float:
    best = np.inf
    for _ in range(repeat):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return float(best)


def planes(work: Callable[[], object], plane: Plane) -> float:
    tracemalloc.start()
    work()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / plane.nbytes


def pair(shape: tuple[int, int]) -> float:
    plane = np.random.default_rng(0).random(shape, dtype=np.float32)
    return seconds(lambda: fft.irfft2(fft.rfft2(plane), s=shape, overwrite_x=True), repeat=5)


def speed(name: str, shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    plane = ndimage.gaussian_filter(rng.random(shape, dtype=np.float32), 3)
    psf = ndimage.zoom(kernel(4), 31 / kernel(4).shape[0], order=1)
    psf = np.maximum(psf, 0) / np.maximum(psf, 0).sum()
    unit = pair(periodic_shape(plane.shape, psf.shape))
    wiener = peers()["scikit-image wiener, as shipped"][-1]
    lucy = peers()["scikit-image richardson_lucy, as shipped"][-1]
    theirs: dict[type[Deconvolver], float] = {
        Wiener: seconds(lambda: wiener(plane, psf)),
        RichardsonLucy: seconds(lambda: lucy(plane, psf)),
    }
    theirs[Tiled] = theirs[RichardsonLucy]
    needed = {**TRANSFORMS, TILED: TRANSFORMS[RichardsonLucy()]}
    rows = []
    for method, compiled in ((each, fast) for each in needed for fast in (False, True)):
        if compiled and (type(method) not in COMPILED or find_spec("numba") is None):
            continue
        loops.LEAST_SIZE = 0 if compiled else 2 * plane.size
        deconvolve(plane[:64, :64].copy(), psf, method)  # compiles
        transforms, kind = needed[method], type(method)
        restore = partial(deconvolve, plane, psf, method)
        cpu = seconds(restore)
        peer = f"{cpu / theirs[kind]:.2f}" if kind in theirs else "-"
        bound = f"{cpu / (transforms / 2 * unit):.2f}"
        peak = f"{planes(restore, plane):.1f}"
        name_of = "Tiled(RichardsonLucy)" if method is TILED else kind.__name__
        label = f"{name_of}, compiled loops" if compiled else name_of
        rows.append([label, f"{transforms / 2:g}", f"{cpu:.2f}", bound, peer, peak])
    print(f"\n{name}, PSF 31 x 31; one pair of transforms {1000 * unit:.0f} ms\n")
    heads = ["", "pairs", "CPU s", "/ FFT bound", "/ scikit-image", "peak memory, planes"]
    table(heads, rows)


def table(heads: list[str], rows: list[list[str]]) -> None:
    print("| " + " | ".join(heads) + " |")
    print("|---" * len(heads) + "|")
    for row in rows:
        print("| " + " | ".join(row) + " |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--large", action="store_true", help="also measure 12 megapixels")
    parser.add_argument("--no-quality", action="store_true", help="speed and memory only")
    options = parser.parse_args()
    if not options.no_quality:
        quality()
        highlights()
    for name in list(SIZES)[: 2 if options.large else 1]:
        speed(name, SIZES[name])


if __name__ == "__main__":
    main()
