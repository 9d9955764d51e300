"""A photo of 12 megapixels in color, deblurred automatically: time of every stage, and memory.

    OMP_NUM_THREADS=1 python benchmarks/big_photo.py [--rows 3000]

A street drawn at random, blurred by a shake of 31 pixels and recorded in 8 bits. Prints a table in
Markdown: CPU seconds of each stage with the default methods, also as a share of the deconvolution's
and in pairs of Fourier transforms of one channel in the same process; and the peak of memory in
float32 planes per channel, beyond the imports and the photo itself.
"""

import argparse
import resource
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

from napari_crfdeblur import DeblurOptions
from napari_crfdeblur.fourier import fast_shape, forward, inverse
from napari_crfdeblur.pipeline import (
    DEFAULT_METHOD,
    estimating_responses,
    finding_blur,
    gathering_profiles,
    joint_curve,
    seeking_edges,
    undoing_blur,
)
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import camera_shake
from napari_crfdeblur.quality import psnr
from napari_crfdeblur.response import GeneralizedGamma, reapply
from napari_crfdeblur.simulate import Camera, Simulated, simulate, street

Result = TypeVar("Result")
SIZE = 31
CAMERA = Camera(GeneralizedGamma((0.85, -0.75, 0.25)), noise=0.003)


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def resident_bytes() -> int:
    pages = Path("/proc/self/statm").read_text().split()[1]
    return int(pages) * resource.getpagesize()


def photo_of(rows: int) -> Simulated:
    shape = rows + SIZE - 1, rows * 4 // 3 + SIZE - 1
    return simulate(street(shape, seed=1), camera_shake(SIZE, 1), CAMERA, seed=1)


def pair_seconds(shape: tuple[int, ...]) -> float:
    plane = np.zeros(fast_shape((shape[0] + SIZE, shape[1] + SIZE)), np.float32)
    times = [timed(lambda: inverse(forward(plane), plane.shape))[1] for _ in range(3)]
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, default=3000, help="of the photo (default: 3000)")
    truth = photo_of(parser.parse_args().rows)
    photo, options = truth.photo, DeblurOptions()
    pair = pair_seconds(photo.shape)
    before = peak_bytes()
    started = resident_bytes()
    edges, seeking = timed(lambda: drain(seeking_edges(photo, options)))
    groups, sampling = timed(lambda: drain(gathering_profiles(options.response, photo, edges)))
    _, fitting = timed(lambda: drain(estimating_responses(groups, options.response)))
    found, finding = timed(lambda: drain(finding_blur(photo, options)))
    method = DEFAULT_METHOD
    sharp_linear, deconvolving = timed(lambda: drain(undoing_blur(found, method)))
    sharp, applying = timed(
        lambda: reapply(sharp_linear, joint_curve(found.responses), photo.dtype)
    )
    rows = {
        "edges": seeking,
        "profiles": sampling,
        "response": fitting,
        "linear light, PSF": finding - seeking - sampling - fitting,
        "response re-applied": applying,
        "all but the deconvolution": finding + applying,
        f"deconvolution, {type(method).__name__}": deconvolving,
    }
    print(f"{photo.shape[1]} x {photo.shape[0]} pixels, one pair of transforms {pair:.2f} s\n")
    print("| stage | CPU s | / deconvolution | pairs |\n|---|---|---|---|")
    for name, seconds in rows.items():
        print(f"| {name} | {seconds:.2f} | {seconds / deconvolving:.2f} | {seconds / pair:.1f} |")
    planes = (peak_bytes() - started) / (4 * photo[..., 0].size * photo.shape[2])
    grown = "" if peak_bytes() > before else " at most: drawing the photo took more"
    print(f"\nPeak memory: {planes:.1f} float32 planes per channel{grown}.")
    print(f"PSNR {psnr(photo, truth.sharp):.2f} dB as blurred, {psnr(sharp, truth.sharp):.2f} dB.")


if __name__ == "__main__":
    main()
