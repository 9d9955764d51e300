"""PSFs from the streaks of lamps: night scenes of known truth, pictures without any, real photos.

    OMP_NUM_THREADS=1 python benchmarks/streaks.py [--half even|odd] [--scenes N] [--no-photos]

A night scene has a dim sky, buildings, lit windows on some of them, and 3 to 10 lamps at places
between pixels that do not hide each other; it is blurred by a shake of the camera, a line or a
bend, gets noise that grows with the light, and is recorded with a gamma of 2.2 in 8 bits. The
brightest lamps clip. Constants were chosen on scenes with even numbers; the table of the
documents is that of odd ones.

Pictures without streaks are sharp photos as they are and blurred, letters on white and on black,
stars of a sharp photo, and lit windows without lamps: an answer to one of them is wrong.

The photos are read from ``../shared/data/sharp`` and ``../shared/data/real`` beside the
repository.
"""

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy.signal import fftconvolve

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.psf import (
    Evidence,
    PsfEstimate,
    Streaks,
    camera_shake,
    delta,
    estimate_psf,
    kernel_b,
    line,
)
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import SRGB, Gamma, ResponseCurve
from napari_crfdeblur.response.saturation import clipped_pixels

Array = NDArray[np.floating]
Photo = NDArray[np.uint8]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
REAL = (
    "IMG_4561.jpg",
    "DSC0065_small.png",
    "IMG_0747_Gaussion.png",
    "image_saturation_1.png",
    "las_vegas_saturated.png",
    "8_patch_use.png",
)
SHAPES = (480, 640), (600, 450), (360, 700), (700, 900)
SIZES = 9, 15, 21, 31, 45
NOISE = 0.001, 0.003, 0.006
SOFT = 0.45  # pixels: standard deviation of a lamp as a sharp photo shows it
RESPONSE = Gamma(2.2)
GOOD = 0.95


def shake_of(seed: int) -> Array:
    """The PSF of a scene: three of five are shakes."""
    size = int(np.random.default_rng(seed).choice(SIZES))
    if seed % 5 < 3:
        return camera_shake(size, seed)
    return line(size - 2, 0.7 + seed) if seed % 5 == 3 else kernel_b()


def ground_of(rng: np.random.Generator, sides: tuple[int, int], *, windows: float) -> Array:
    """Sky and buildings, some of them with windows in rows."""
    rows, columns = sides
    scene = np.ones((rows, columns, 3)) * np.linspace(1, 0.4, rows)[:, None, None]
    scene *= rng.uniform(0.002, 0.02)
    for _ in range(rng.integers(4, 12)):
        top, left = rng.integers(0, rows - 40), rng.integers(0, columns - 40)
        height, width = rng.integers(30, 250, 2)
        scene[top : top + height, left : left + width] = rng.uniform(0.002, 0.06, 3)
        if rng.random() < windows:
            for row in range(top + 6, min(top + height - 14, rows - 14), 22):
                for column in range(left + 6, min(left + width - 12, columns - 12), 18):
                    if rng.random() < 0.3:
                        light = rng.uniform(0.05, 0.8) * rng.uniform(0.6, 1, 3)
                        scene[row : row + 10, column : column + 7] = light
    return scene


def lamps_in(
    rng: np.random.Generator, scene: Array, psf: Array, inside: int, powers: tuple[float, float]
) -> None:
    """Put 3 to 10 lamps on a scene, none so near another that their streaks touch."""
    reach, places = max(psf.shape) // 2 + 8, np.empty((0, 2))
    dark = scene.max(axis=2) < 0.05
    for _ in range(int(rng.integers(3, 11))):
        for _ in range(200):
            place = np.array(
                [rng.uniform(inside + reach, side - inside - reach) for side in dark.shape]
            )
            row, column = place.astype(int)
            around = dark[row - reach : row + reach, column - reach : column + reach]
            if around.all() and (np.abs(places - place).max(axis=1) > 2 * reach).all():
                break
        else:
            continue  # no room
        places = np.concatenate([places, place[None]])
        power = np.exp(rng.uniform(*np.log(powers))) / psf.max()
        color = rng.uniform(0.4, 1, 3)
        near = np.arange(-3, 4)
        spot = np.exp(-np.square(near[:, None] - (place - [row, column])) / (2 * SOFT**2))
        spot = np.outer(*(spot / spot.sum(axis=0)).T)[..., None] * color / color.max()
        scene[row - 3 : row + 4, column - 3 : column + 4] += power * spot


def recorded(rng: np.random.Generator, light: Array, noise: float) -> Photo:
    spread = noise * np.sqrt(0.1 + np.clip(light, 0, 1))
    noisy = np.clip(light + rng.normal(0, 1, light.shape) * spread, 0, 1)
    return np.rint(255 * RESPONSE.to_intensity(noisy)).astype(np.uint8)


def night(seed: int, *, lamps: bool = True) -> tuple[Photo, Array]:
    """A scene and its PSF."""
    rng = np.random.default_rng(seed)
    psf, inside = shake_of(seed), 60
    rows, columns = SHAPES[seed // 2 % len(SHAPES)]
    scene = ground_of(rng, (rows + 2 * inside, columns + 2 * inside), windows=0.3 if lamps else 1)
    if lamps:
        lamps_in(rng, scene, psf, inside, (0.12, 2.0))
    light = fftconvolve(scene, psf[..., None], mode="same", axes=(0, 1))
    return recorded(rng, light[inside:-inside, inside:-inside], NOISE[seed % 3]), psf


def letters(seed: int, paper: int, ink: int, psf: Array) -> Photo:
    """Lines of words."""
    rng = np.random.default_rng(seed)
    page = Image.new("L", (640, 420), paper)
    font = ImageFont.load_default(size=18 + 4 * (seed % 4))
    for row in range(8, 400, 34):
        words = ("".join(map(chr, rng.integers(97, 123, rng.integers(2, 9)))) for _ in range(9))
        ImageDraw.Draw(page).text((10, row), " ".join(words), ink, font)
    light = RESPONSE.to_irradiance(np.asarray(page) / 255)
    return recorded(rng, fftconvolve(light, psf, mode="same"), 0.002)


def stars(seed: int) -> Photo:
    """A sharp photo of the sky."""
    rng = np.random.default_rng(seed)
    scene = np.full((400, 560), 0.004)
    row, column = rng.integers(5, 390, 120), rng.integers(5, 550, 120)
    scene[row, column] += rng.exponential(1.0, 120)
    return recorded(
        rng, fftconvolve(scene, np.outer([1, 4, 1], [1, 4, 1]) / 36, mode="same"), 0.003
    )


def without_streaks(seeds: range, photos: bool) -> Iterator[tuple[str, Photo]]:
    for seed in seeds:
        psf = shake_of(seed)
        yield "letters on white", letters(seed, 250, 20, delta())
        yield "letters on white, blurred", letters(seed, 250, 20, psf)
        yield "letters on black", letters(seed, 4, 200, delta())
        yield "letters on black, blurred", letters(seed, 4, 200, psf)
        yield "stars, sharp", stars(seed)
        yield "windows without lamps", night(seed, lamps=False)[0]
    paths = sorted((DATA / "sharp").glob("*.png")) if photos else []
    for number, path in enumerate(paths):
        photo = iio.imread(path)[:700, :900, :3]
        yield "photo, sharp", photo
        light = fftconvolve(
            RESPONSE.to_irradiance(photo / 255),
            shake_of(number)[..., None],
            mode="same",
            axes=(0, 1),
        )
        yield "photo, blurred", recorded(np.random.default_rng(number), light, 0.003)


def answer(photo: Photo, response: ResponseCurve) -> tuple[PsfEstimate | None, float]:
    """What is found, and CPU seconds for each megapixel."""
    linear, clipped = response.to_irradiance(photo / 255), clipped_pixels(photo)
    start = time.process_time()
    try:
        found = estimate_psf(Evidence(linear, clipped), Streaks())
    except CrfDeblurError:
        found = None
    return found, (time.process_time() - start) / (photo.shape[0] * photo.shape[1] / 1e6)


def scenes_table(seeds: range) -> None:
    print(
        "| lamps in the scene | scenes | an answer | likeness >= .95 | median | least | CPU s/Mpx |"
    )
    print("|---" * 7 + "|")
    likeness, seconds = [], []
    for seed in seeds:
        photo, psf = night(seed)
        found, spent = answer(photo, RESPONSE)
        likeness.append(np.nan if found is None else kernel_similarity(found.psf, psf))
        seconds.append(spent)
    values = np.array(likeness)
    told = values[np.isfinite(values)]
    print(
        f"| 3 to 10 | {len(values)} | {len(told)} | {np.count_nonzero(told >= GOOD)} | "
        f"{np.median(told):.3f} | {told.min():.3f} | {np.median(seconds):.2f} |"
    )


def refusals_table(seeds: range, photos: bool) -> None:
    print("\n| without streaks | pictures | wrong answers | called good | CPU s/Mpx, most |")
    print("|---" * 5 + "|")
    kinds: dict[str, list[tuple[PsfEstimate | None, float]]] = {}
    for kind, photo in without_streaks(seeds, photos):
        kinds.setdefault(kind, []).append(answer(photo, RESPONSE))
    for kind, answers in kinds.items():
        told = [found for found, _ in answers if found is not None]
        good = sum(not found.status.doubted for found in told)
        most = max(spent for _, spent in answers)
        print(f"| {kind} | {len(answers)} | {len(told)} | {good} | {most:.2f} |", flush=True)


def real_table() -> None:
    print("\n| real photo | streaks | agreement | likeness to the published PSF | CPU s/Mpx |")
    print("|---" * 5 + "|")
    for name in REAL:
        photo = iio.imread(DATA / "real" / name)[..., :3]
        published = iio.imread(DATA / "real" / f"{Path(name).stem}__published_psf.png").astype(
            float
        )
        found, spent = answer(photo, SRGB())
        if found is None:
            print(f"| `{Path(name).stem}` | refused | | | {spent:.2f} |")
            continue
        figures, like = found.diagnostics, kernel_similarity(found.psf, published)
        print(
            f"| `{Path(name).stem}` | {figures['streaks']:.0f} | {figures['agreement']:.3f} "
            f"| {like:.3f} | {spent:.2f} |"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--half", choices=("even", "odd"), default="odd")
    parser.add_argument("--scenes", type=int, default=60)
    parser.add_argument("--no-photos", action="store_true")
    asked = parser.parse_args()
    first = int(asked.half == "odd")
    scenes_table(range(first, 2 * asked.scenes, 2))
    refusals_table(range(first, 20, 2), not asked.no_photos)
    if not asked.no_photos:
        real_table()


if __name__ == "__main__":
    main()
