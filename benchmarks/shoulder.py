"""What a long shoulder of the response costs, and what weights buy there, as a table in Markdown.

Pictures of a camera whose last five codes hold a tenth of the light (sRGB below), blurred by drawn
camera shakes of 9, 17 and 25 pixels, with noise of .006, as 8 bits and as JPEG 95. Restored with
the true PSF and all defaults of the path: with the true response, its pixels weighted by its slope
or all alike, and with a response that goes on smoothly where the shoulder begins. Shown is the gain
in decibels over the blurred picture, in recorded intensity, and what the true response gains at
least and on average over the other. With clipped light known by value and shape as by default, and
with nothing taken for clipped. The pictures are those of ``../shared/data/sharp`` beside the
repository in two halves.

    OMP_NUM_THREADS=1 python benchmarks/shoulder.py            # the second half
    OMP_NUM_THREADS=1 python benchmarks/shoulder.py --chosen   # the first half
"""

import argparse
from collections import defaultdict
from io import BytesIO

import numpy as np
from clipped_light import Plane, pictures
from numpy.typing import NDArray
from PIL import Image
from scipy.signal import fftconvolve

from napari_crfdeblur.deconvolution import deconvolve
from napari_crfdeblur.pipeline import DEFAULT_METHOD
from napari_crfdeblur.psf import as_psf, camera_shake
from napari_crfdeblur.response import SRGB, ResponseCurve, Tabulated, clipped_light, pixel_worth

SIZES, NOISE, KNEE, CODES = (9, 17, 25), 0.006, 0.9, 250 / 255


def response(shoulder: bool) -> ResponseCurve:
    """sRGB up to the knee; then the rest of the light in five codes, or on as before."""
    light = np.linspace(0, 1, 2001)
    below = CODES * SRGB().to_intensity(np.minimum(light / KNEE, 1))
    rest = (light - KNEE) / (1 - KNEE) * (1 - CODES)
    if shoulder:
        return Tabulated(light, np.where(light < KNEE, below, CODES + rest))
    whole = SRGB().to_intensity(light)
    return Tabulated(light, whole / whole[-1])


def photographed(picture: Plane, psf: Plane, quality: int, seed: int) -> tuple[Plane, Plane]:
    """The scene, and the photo as intensity."""
    scene = SRGB().to_irradiance(picture)
    scene = (scene / np.quantile(scene, 0.995)).clip(0, 0.999)
    side = len(psf)
    light = fftconvolve(np.pad(scene, side, mode="reflect"), psf, mode="same")
    seen = response(True).to_intensity(light[side:-side, side:-side].clip(0, 1))
    noisy = seen + np.random.default_rng(seed).normal(0, NOISE, seen.shape)
    codes: NDArray[np.uint8] = np.rint(255 * noisy.clip(0, 1)).astype(np.uint8)
    if quality:
        file = BytesIO()
        Image.fromarray(codes).save(file, "JPEG", quality=quality)
        codes = np.asarray(Image.open(BytesIO(file.getvalue())))
    return scene, codes


def gain(
    scene: Plane,
    photo: Plane,
    psf: Plane,
    curve: ResponseCurve,
    *,
    weighted: bool = True,
    clipped: bool = True,
) -> float:
    light = curve.to_irradiance(photo / 255).astype(np.float32)
    sharp = deconvolve(
        light,
        psf,
        DEFAULT_METHOD,
        clipped=clipped_light(photo) if clipped else None,
        weights=pixel_worth(light, curve) if weighted else None,
    )
    inside = (slice(len(psf), -len(psf)),) * 2
    truth = response(True).to_intensity(scene)
    restored = curve.to_intensity(sharp.clip(0, 1))
    errors = [np.mean(np.square(each - truth)[inside]) for each in (photo / 255, restored)]
    return float(10 * np.log10(errors[0] / errors[1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--chosen", action="store_true", help="on the half that served for tuning")
    rows, true, smooth = defaultdict(list), response(True), response(False)
    for number, picture in enumerate(pictures(parser.parse_args().chosen)):
        for size in SIZES:
            psf = as_psf(camera_shake(size, seed=size + number))
            for quality in (0, 95):
                case = (*photographed(picture, psf, quality, size), psf)
                for clipped in (True, False):
                    known = "known" if clipped else "not known"
                    rows[known, "smooth"].append(gain(*case, smooth, clipped=clipped))
                    for weighted in (False, True):
                        what = "true, weighted" if weighted else "true, all alike"
                        found = gain(*case, true, weighted=weighted, clipped=clipped)
                        rows[known, what].append(found)
    print("| clipped light | response | gain | least over the smooth one | mean |")
    print("|---|---|---|---|---|")
    for (known, what), gains in rows.items():
        over = np.array(gains) - rows[known, "smooth"]
        figures = f"{np.mean(gains):.2f} | {over.min():+.2f} | {over.mean():+.2f}"
        print(f"| {known} | {what} | {figures} |")


if __name__ == "__main__":
    main()
