"""What the guard takes back, with right and with wrong PSFs and responses, as a table in Markdown.

Pictures of a camera with the response of sRGB, blurred by drawn camera shakes of 7, 15 and 25
pixels with noise of .002 to .012 and 8 bits, are restored with the PSF that they were blurred by,
one that is 30 % too wide or too narrow, turned by 10 degrees, and a straight line in its place;
and with the right PSF and other responses. Shown is the gain in decibels over the blurred picture,
in recorded intensity, mean and least, and how often more than .3 dB are lost, without and with the
guard. The pictures are those of ``../shared/data/sharp`` beside the repository in two halves:
constants were chosen on the first, results are those of the second.

    OMP_NUM_THREADS=1 python benchmarks/guard.py            # the second half
    OMP_NUM_THREADS=1 python benchmarks/guard.py --chosen   # the first half
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.signal import fftconvolve
from skimage import color, data, io

from napari_crfdeblur.deconvolution import deconvolve, guard
from napari_crfdeblur.pipeline import DEFAULT_METHOD
from napari_crfdeblur.psf import as_psf, camera_shake, line
from napari_crfdeblur.response import SRGB, Gamma, Identity, ResponseCurve

Plane = NDArray[np.floating]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "sharp"
SIZES, NOISES = (7, 15, 25), (0.002, 0.006, 0.012)
HARM = -0.3  # decibels


def pictures(chosen: bool) -> list[Plane]:
    """Gray pictures: every second of those that there are."""
    paths = sorted(DATA.glob("*.png"))[0 if chosen else 1 :: 2]
    whole = [color.rgb2gray(io.imread(path)) for path in paths] or [data.camera() / 255.0]
    return [np.asarray(each[40:400, 40:520]) for each in whole]


def scaled(psf: Plane, factor: float) -> Plane:
    """The PSF wider or narrower about its middle."""
    side = int(np.ceil(len(psf) * max(factor, 1))) | 1
    padded = np.pad(psf, (side - len(psf)) // 2)
    middle = (side - 1) / 2
    wide = ndimage.affine_transform(
        padded, np.eye(2) / factor, offset=middle - middle / factor, order=1
    )
    return as_psf(wide.clip(0))


def turned(psf: Plane, degrees: float) -> Plane:
    wide = np.pad(psf, len(psf) // 4)
    return as_psf(ndimage.rotate(wide, degrees, reshape=False, order=1).clip(0))


def assumptions(psf: Plane, rng: np.random.Generator) -> Iterator[tuple[str, Plane, ResponseCurve]]:
    """What a picture is restored with: what it is called, a PSF and a response."""
    straight = as_psf(line(0.8 * len(psf), float(rng.uniform(0, np.pi))))
    yield "right", psf, SRGB()
    yield "identity for sRGB", psf, Identity()
    yield "gamma 3 for sRGB", psf, Gamma(3.0)
    yield "PSF 30 % too wide", scaled(psf, 1.3), SRGB()
    yield "PSF 30 % too narrow", scaled(psf, 0.7), SRGB()
    yield "PSF turned by 10 degrees", turned(psf, 10), SRGB()
    yield "a straight line as PSF", straight, SRGB()


def photo_of(sharp: Plane, psf: Plane, noise: float, rng: np.random.Generator) -> Plane:
    side = len(psf)
    light = np.pad(SRGB().to_irradiance(sharp), side, mode="reflect")
    seen = fftconvolve(light, psf, mode="same")[side:-side, side:-side].clip(0, 1)
    noisy = SRGB().to_intensity(seen) + rng.normal(0, noise, sharp.shape)
    return np.asarray(np.round(noisy.clip(0, 1) * 255) / 255)


def gains(sharp: Plane, photo: Plane, psf: Plane, curve: ResponseCurve) -> list[float]:
    """Of the default method, without and with the guard."""
    inside = (slice(len(psf), -len(psf)),) * 2
    light = curve.to_irradiance(photo).astype(np.float32)
    free, found = deconvolve(light, psf, DEFAULT_METHOD), []
    for sharp_light in (free, guard(light, free, psf.shape).sharp):
        restored = curve.to_intensity(sharp_light.clip(0, 1))
        errors = [np.mean((each - sharp)[inside] ** 2) for each in (photo, restored)]
        found.append(float(10 * np.log10(errors[0] / errors[1])))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--chosen", action="store_true", help="on the half that served for tuning")
    chosen = parser.parse_args().chosen
    rng, rows = np.random.default_rng(1 if chosen else 2), defaultdict(list)
    for number, sharp in enumerate(pictures(chosen)):
        for size in SIZES:
            psf = as_psf(camera_shake(size, seed=int(rng.integers(1000))))
            photo = photo_of(sharp, psf, NOISES[(number + size) % 3], rng)
            for name, assumed, curve in assumptions(psf, rng):
                rows[name].append(gains(sharp, photo, assumed, curve))
    print("| restored with | mean | least | worse | guarded: mean | least | worse |")
    print("|---|---|---|---|---|---|---|")
    for name, both in rows.items():
        cells = []
        for each in zip(*both, strict=True):
            harmed = sum(gain < HARM for gain in each)
            cells.append(f"{np.mean(each):+.2f} | {min(each):+.2f} | {harmed} of {len(each)}")
        print(f"| {name} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
