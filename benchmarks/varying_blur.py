"""Photos of a camera that turned: one PSF against one for every part, as a table in Markdown.

    OMP_NUM_THREADS=1 python benchmarks/varying_blur.py [--photos FOLDER] [--grid 3x4]

Simulated streets, and photos from a folder if it is there, are blurred by a shake and a turn of
the camera; every pixel is blurred by the motion itself, not by a PSF. PSNR is that in linear
light, without a border of 24 pixels, after the best shift and turn, since no PSF tells where the
camera looked at first: of the blurred photo, restored with the one PSF that is found, with those
found for all parts, and with the true ones of all parts. CPU seconds are those of the search in
all parts and of the deconvolution with them, each as a multiple of what one PSF takes.
"""

import argparse
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, optimize

from napari_crfdeblur.deconvolution import LocalShrinkage, deconvolve
from napari_crfdeblur.deconvolution.varying import deconvolve_varying
from napari_crfdeblur.psf import PsfField, PsfStatus, Variational, estimate_psf, estimate_psf_field
from napari_crfdeblur.psf.field.base import offset_from_middle
from napari_crfdeblur.psf.field.poses import fit_poses, turns_within
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import Gamma, Identity, linearize
from napari_crfdeblur.simulate import Camera, Scene, Simulated, camera_turn, simulate, street

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "sharp"
METHOD = LocalShrinkage()
SHAKE, NOISE = 11, 0.003
TURNS = (0.0, 0.01, 0.02, 0.03)
BORDER = 24
T = TypeVar("T")
Array = NDArray[np.floating]


def scenes(folder: Path) -> Iterator[tuple[str, Scene]]:
    yield "street", street((440, 600), seed=1)
    for path in sorted(folder.glob("*.png"))[:2]:
        yield path.stem, Scene(linearize(iio.imread(path)[..., :3], Gamma(2.2)))


def timed(function: Callable[[], T]) -> tuple[T, float]:
    start = time.process_time()
    result = function()
    return result, time.process_time() - start


def decibels(restored: Array, sharp: Array) -> float:
    """PSNR of a picture that is moved onto the sharp one."""
    motion = optimize.minimize(
        lambda motion: error(moved(restored.mean(axis=2), motion), sharp.mean(axis=2)),
        np.zeros(3),
        method="Nelder-Mead",
        options={"initial_simplex": np.vstack([np.zeros(3), 0.7 * np.eye(3)]), "xatol": 0.01},
    ).x
    planes = [moved(restored[..., channel], motion) for channel in range(restored.shape[2])]
    return float(-10 * np.log10(error(np.stack(planes, axis=2), sharp)))


def moved(plane: Array, motion: Array) -> Array:
    """A plane turned by so many milliradians about its middle, and shifted."""
    turn, middle = motion[0] / 1000, (np.array(plane.shape) - 1) / 2
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    offset = middle - matrix @ middle + motion[1:]
    return np.asarray(ndimage.affine_transform(plane, matrix, offset, order=3, mode="nearest"))


def error(first: Array, second: Array) -> float:
    inside = slice(BORDER, -BORDER)
    return float(np.square(first - second)[inside, inside].mean())


def true_field(truth: Simulated, found: PsfField) -> PsfField:
    """The PSFs of the motion that made the photo, on the grid of those found."""
    centers = found.centers.reshape(-1, 2)
    offsets = np.array([offset_from_middle((r, c), found.shape) for r, c in centers])
    psfs = [truth.motion.psf_at((r, c)) for r, c in offsets]
    size = max(max(psf.shape) for psf in psfs)
    padded = np.stack([np.pad(p, [((size - side) // 2,) * 2 for side in p.shape]) for p in psfs])
    turns = turns_within(size / 4, float(np.hypot(*offsets.T).max()))
    poses = fit_poses(padded, offsets, np.ones(len(padded)), turns)
    return PsfField(padded.reshape(*found.grid, size, size), found.statuses, found.shape, poses)


def print_row(name: str, turn: float, truth: Simulated, grid: tuple[int, int]) -> None:
    light = truth.photo
    one, alone = timed(lambda: estimate_psf(light, Variational()))
    field, search = timed(lambda: estimate_psf_field(light, Variational(), one, grid=grid))
    single, quick = timed(lambda: deconvolve(light, one.psf, METHOD))
    parts, slow = timed(lambda: deconvolve_varying(light, field, METHOD))
    known = true_field(truth, field)
    best = deconvolve_varying(light, known, METHOD)
    pictures = (np.clip(x, 0, 1) for x in (light, single, parts, best))
    values = [decibels(picture, truth.sharp_linear) for picture in pictures]
    likeness = [
        np.mean([kernel_similarity(own, psf) for own, psf in zip(found, true, strict=True)])
        for true in [known.psfs.reshape(-1, *known.psfs.shape[2:])]
        for found in ([one.psf] * len(true), field.psfs.reshape(-1, *field.psfs.shape[2:]))
    ]
    borrowed = sum(status is PsfStatus.BORROWED for row in field.statuses for status in row)
    print(
        f"| {name} | {np.degrees(turn):.2f} | "
        + " | ".join(f"{v:.2f}" for v in values)
        + f" | {likeness[0]:.3f} | {likeness[1]:.3f} | {borrowed} of {grid[0] * grid[1]} | "
        f"{search / alone:.1f} | {slow / quick:.1f} |",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--photos", type=Path, default=DATA)
    parser.add_argument("--grid", default="3x4")
    options = parser.parse_args()
    rows, _, columns = options.grid.partition("x")
    print(
        "| scene | turn, degrees | blurred, dB | one PSF | a PSF for every part | true PSFs "
        "| likeness, one | likeness, parts | borrowed | search, x one | deconvolution, x one |"
    )
    print("|---" * 11 + "|")
    for name, scene in scenes(options.photos):
        for turn in TURNS:
            motion = camera_turn(SHAKE, turn, 3, scene.linear.shape[:2])
            camera = Camera(Identity(), noise=NOISE, bits=None)
            truth = simulate(scene, motion, camera, seed=1)
            print_row(name, turn, truth, (int(rows), int(columns)))


if __name__ == "__main__":
    main()
