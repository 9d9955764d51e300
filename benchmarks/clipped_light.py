"""What clipped lights cost, as a table in Markdown: as the camera clipped them, and resized since.

Pictures with lamps up to fifty times as bright as white are blurred by drawn camera shakes of 9, 15
and 21 pixels and exposed so that .5, 2 and 5 % of the pixels clip; response of sRGB, noise .004.
Recorded with 8 bits as they are, or clipped at twice the size, made half as large, and compressed
as JPEG 90. Restored with the true PSF and response. Shown is what is lost in decibels (linear
light, cut to what a photo holds) against the same photo with unclipped light: far from the lights,
which is more than one PSF away, and near them; and the share of pixels that come out darker than
the darkest of the true scene within a PSF, by more than three times the error of the unclipped
restoration far from the lights. Without knowing what clipped, by values alone, and by shape, too.
The pictures are those of ``../shared/data/sharp`` beside the repository in two halves.

    OMP_NUM_THREADS=1 python benchmarks/clipped_light.py            # the second half
    OMP_NUM_THREADS=1 python benchmarks/clipped_light.py --chosen   # the first half
"""

import argparse
from collections import defaultdict
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage
from scipy.signal import fftconvolve
from skimage import color, data, io

from napari_crfdeblur.deconvolution import deconvolve, guard
from napari_crfdeblur.pipeline import DEFAULT_METHOD
from napari_crfdeblur.psf import as_psf, camera_shake
from napari_crfdeblur.response import SRGB, clipped_light, clipped_pixels

Plane = NDArray[np.floating]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "sharp"
CASES = ((9, 0.005), (15, 0.02), (21, 0.05))  # sides of the PSF, share that clips
NOISE, QUALITY = 0.004, 90
SLOPE = float(SRGB().slope(1.0))  # beyond white the response of the unclipped photo goes on so


@dataclass(frozen=True)
class Photo:
    """A photo of lamps, clipped and not, and what is true."""

    scene: Plane
    psf: Plane
    recorded: NDArray[np.uint8]
    unclipped: Plane  # linear light
    clipped: NDArray[np.bool_]


def pictures(chosen: bool) -> list[Plane]:
    paths = sorted(DATA.glob("*.png"))[0 if chosen else 1 :: 2]
    whole = [color.rgb2gray(io.imread(path)) for path in paths] or [data.camera() / 255.0]
    return [np.asarray(each[40:360, 40:440]) for each in whole]


def with_lamps(picture: Plane, rng: np.random.Generator) -> Plane:
    """Linear light of a picture with some lamps, their rims a pixel wide."""
    light = 0.6 * SRGB().to_irradiance(picture)
    rows, columns = np.mgrid[: light.shape[0], : light.shape[1]]
    for _ in range(int(rng.integers(5, 14))):
        row, column = (rng.uniform(10, side - 10) for side in light.shape)
        radius, peak = rng.uniform(1, 5), 10 ** rng.uniform(0.5, 1.7)
        distance = np.hypot(rows - row, columns - column) - radius
        light += peak * min(1, 9 / radius**2) / (1 + np.exp(np.minimum(2 * distance, 50)))
    return light


def photographed(
    picture: Plane, size: int, share: float, resized: bool, rng: np.random.Generator
) -> Photo:
    psf = as_psf(camera_shake(size, seed=int(rng.integers(1000))))
    scene = with_lamps(picture, rng)
    light = fftconvolve(np.pad(scene, size, mode="reflect"), psf, mode="same")
    light = light[size:-size, size:-size].clip(0)
    exposure = 1 / np.quantile(light, 1 - share)
    light, scene = exposure * light, exposure * scene
    if resized:
        large = ndimage.zoom(light, 2, order=3, mode="nearest", grid_mode=True).clip(0)
        seen = intensity(large) + rng.normal(0, 2 * NOISE, large.shape)
        small = compressed(halved(seen.clip(0, 1)))
        lost, over = halved(seen >= 1.0) > 0, halved(seen - np.minimum(seen, 1))
    else:
        seen = intensity(light) + rng.normal(0, NOISE, light.shape)
        small = np.rint(255 * seen.clip(0, 1)).astype(np.uint8)
        lost, over = seen >= 1, seen - np.minimum(seen, 1)
    return Photo(scene, psf, small, irradiance(small / 255 + over), lost)


def intensity(light: Plane) -> Plane:
    return np.where(light < 1, SRGB().to_intensity(light.clip(0, 1)), 1 + SLOPE * (light - 1))


def irradiance(seen: Plane) -> Plane:
    return np.where(seen < 1, SRGB().to_irradiance(seen.clip(0, 1)), 1 + (seen - 1) / SLOPE)


def halved(picture: Plane) -> Plane:
    rows, columns = (side // 2 for side in picture.shape)
    return np.asarray(picture.reshape(rows, 2, columns, 2).mean(axis=(1, 3)))


def compressed(picture: Plane) -> NDArray[np.uint8]:
    file = BytesIO()
    Image.fromarray(np.rint(255 * picture).astype(np.uint8)).save(file, "JPEG", quality=QUALITY)
    return np.asarray(Image.open(BytesIO(file.getvalue())))


def errors(photo: Photo, sharp: Plane) -> tuple[float, float, Plane]:
    """Errors far from and near the lights, and by how much each pixel is too dark."""
    side = len(photo.psf)
    inside = np.zeros(photo.scene.shape, dtype=bool)
    inside[side:-side, side:-side] = True
    near = ndimage.binary_dilation(photo.clipped, np.ones((side, side)))
    wrong = np.square(sharp.clip(0, 1) - photo.scene.clip(0, 1))
    darkest = ndimage.minimum_filter(photo.scene, side).clip(0, 1)
    dark = (darkest - sharp.clip(0, 1))[side:-side, side:-side]
    return float(wrong[inside & ~near].mean()), float(wrong[inside & near].mean()), dark


def losses(photo: Photo) -> dict[str, tuple[float, float, float]]:
    """Decibels lost far and near, and share of pixels that are too dark, for each way."""
    free = deconvolve(photo.unclipped.astype(np.float32), photo.psf, DEFAULT_METHOD)
    far, near, dark = errors(photo, free)
    limit = 3 * far**0.5
    light = SRGB().to_irradiance(photo.recorded / 255).astype(np.float32)
    masks = {
        "not known": None,
        "by values": clipped_pixels(photo.recorded),
        "by shape": clipped_light(photo.recorded),
    }
    found = {"unclipped": (0.0, 0.0, float((dark > limit).mean()))}
    for name, clipped in masks.items():
        sharp = deconvolve(light, photo.psf, DEFAULT_METHOD, clipped=clipped)
        sharp = guard(light, sharp, photo.psf.shape, clipped=clipped).sharp
        own_far, own_near, dark = errors(photo, sharp)
        lost = (10 * np.log10(own / known) for own, known in ((own_far, far), (own_near, near)))
        found[name] = (*(float(each) for each in lost), float((dark > limit).mean()))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--chosen", action="store_true", help="on the half that served for tuning")
    chosen = parser.parse_args().chosen
    print("| photo | clipped light | far: mean | most | near: mean | too dark, % |")
    print("|---|---|---|---|---|---|")
    for resized in (False, True):
        rng, rows = np.random.default_rng(1 if chosen else 2), defaultdict(list)
        for picture in pictures(chosen):
            for size, share in CASES:
                for name, each in losses(photographed(picture, size, share, resized, rng)).items():
                    rows[name].append(each)
        for name, each in rows.items():
            far, near, dark = np.array(each).T
            what = "resized and compressed" if resized else "as clipped"
            print(
                f"| {what} | {name} | {far.mean():+.2f} | {far.max():+.2f} | {near.mean():+.2f} "
                f"| {100 * dark.mean():.3f} |"
            )


if __name__ == "__main__":
    main()
