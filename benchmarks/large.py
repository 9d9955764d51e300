"""Large photos: tiles against the whole in time, memory and result, as tables in Markdown.

Run it with one thread, so that CPU seconds compare::

    OMP_NUM_THREADS=1 python benchmarks/large.py           # tiles in memory, 2 megapixels
    OMP_NUM_THREADS=1 python benchmarks/large.py --large   # 12 Mpx, and 1 to 64 Mpx out of core

The first table is the difference that tiles make, beside the error of the whole: pictures of
natural scenes (from ``../shared/data`` beside the repository, else from scikit-image), blurred and
with noise, restored whole and in tiles whose margins are so many sides of the PSF wide. The second
one is the time of tiles in memory, as a share of that of the whole. The third one is the time and
memory of a photo that stays in its file, restored into another file by 5 Richardson-Lucy steps;
each case is a process of its own, whose peak is given beyond what the imports take and, for the
whole, beyond the photo and its result. Times are the least of three turns.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from math import log10
from pathlib import Path

import numpy as np
import tifffile
from numpy.typing import NDArray
from scipy.signal import fftconvolve
from skimage import color, data, io

from napari_crfdeblur.deconvolution import (
    Deconvolver,
    HyperLaplacian,
    RichardsonLucy,
    SparseIrls,
    Tiled,
    Wiener,
    deconvolve,
)
from napari_crfdeblur.large import restore_large, store
from napari_crfdeblur.psf import camera_shake, gaussian
from napari_crfdeblur.response import Identity

Plane = NDArray[np.floating]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "sharp"
METHODS = (RichardsonLucy(), Wiener(), HyperLaplacian(), SparseIrls())
REACHES = (0.5, 1, 2, 3)
SIDES = {"1 Mpx": 1024, "4 Mpx": 2048, "16 Mpx": 4096, "64 Mpx": 8192}
LUCY = RichardsonLucy(5)
TURNS = 3


def picture(rows: int, columns: int) -> Plane:
    names = [DATA / f"{name}.png" for name in ("kodim01", "kodim23", "kodim07", "kodim15")]
    if names[0].exists():
        found = [color.rgb2gray(io.imread(path)) for path in names]
    else:
        found = [data.camera() / 255.0, data.moon() / 255.0]
    column = np.vstack([each[:480, :500] for each in found])
    tall = np.vstack([column, column[::-1]])
    tile = np.hstack([tall, tall[:, ::-1]])
    repeats = -(-rows // tile.shape[0]), -(-columns // tile.shape[1])
    return np.tile(tile, repeats)[:rows, :columns]


def photograph(rows: int, columns: int, psf: Plane, noise: float) -> tuple[Plane, Plane]:
    scene = picture(rows + psf.shape[0] - 1, columns + psf.shape[1] - 1)
    blurred = fftconvolve(scene, psf, mode="valid")
    blurred += np.random.default_rng(0).normal(0, noise, blurred.shape)
    top, left = ((side - 1) // 2 for side in psf.shape)
    sharp = scene[top : top + rows, left : left + columns]
    return sharp, blurred.clip(0).astype(np.float32)


def rms(values: Plane) -> float:
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64))))


def differences() -> None:
    head = ["PSF, noise", "method", "error of the whole, dB", *(f"{r} sides" for r in REACHES)]
    rows = []
    for name, psf in (
        ("shake 15", camera_shake(15, 3)),
        ("shake 31", camera_shake(31, 5)),
        ("Gaussian 4", gaussian(4.0)),
    ):
        for noise in (0.002, 0.01):
            sharp, blurred = photograph(1000, 1100, psf, noise)
            for method in METHODS:
                whole = deconvolve(blurred, psf, method)
                cells = [
                    _difference(blurred, psf, method, reach, whole, sharp) for reach in REACHES
                ]
                error = f"{-20 * log10(rms(whole - sharp)):.2f}"
                rows.append([f"{name}, {noise}", type(method).__name__, error, *cells])
    print(
        "\nDifference of tiles of about 400 pixels from the whole: rms / 99th percentile; "
        "change of the PSNR in dB\n"
    )
    table(head, rows)


def _difference(
    blurred: Plane, psf: Plane, method: Deconvolver, reach: float, whole: Plane, sharp: Plane
) -> str:
    overlap = round(reach * max(psf.shape))
    side = 400 + 2 * overlap + max(psf.shape) - 1
    tiles = deconvolve(blurred, psf, Tiled(method, side=side, overlap=overlap))
    change = 20 * log10(rms(whole - sharp) / rms(tiles - sharp))
    off = np.abs(tiles - whole)
    return f"{rms(off):.0e} / {np.percentile(off, 99):.0e}; {change:+.3f}"


def seconds(*works: Callable[[], object]) -> list[float]:
    """CPU seconds of each, the least of some turns: others use the machine, too."""
    turns = []
    for _ in range(TURNS):
        times = [time.process_time()]
        for work in works:
            work()
            times.append(time.process_time())
        turns.append(np.diff(times))
    return np.min(turns, axis=0).tolist()


def speed(rows: int, columns: int) -> None:
    psf = camera_shake(31, 5)
    _, blurred = photograph(rows, columns, psf, 0.01)
    cells = []
    for method in METHODS[:3]:
        deconvolve(blurred[:600, :700], psf, method)
        whole, tiles = seconds(
            lambda m=method: deconvolve(blurred, psf, m),
            lambda m=method: deconvolve(blurred, psf, Tiled(m)),
        )
        grid = Tiled(method).grid(blurred.shape, psf.shape)
        size = f"{grid.counts[0]} x {grid.counts[1]}"
        cells.append(
            [type(method).__name__, f"{whole:.2f}", f"{tiles:.2f}", f"{tiles / whole:.2f}", size]
        )
    print(f"\n{rows} x {columns} pixels, PSF 31 x 31, in memory\n")
    table(["", "whole, CPU s", "tiles, CPU s", "ratio", "tiles"], cells)


def out_of_core() -> None:
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, side in SIDES.items():
            path = Path(folder) / f"{side}.tif"
            _, blurred = photograph(side, side, camera_shake(31, 5), 0.01)
            recorded = np.clip(blurred, 0, 1, out=blurred)
            tifffile.imwrite(path, recorded, tile=(256, 256), photometric="minisblack")
            del blurred, recorded
            found = {}
            for _ in range(TURNS):
                for way in ("whole", "threads", "zarr", "cluster"):
                    each = measured(way, path)
                    found[way] = min(each, found.get(way, each), key=lambda case: case["cpu"])
            base = found["whole"]["cpu"]
            for way, each in found.items():
                rows.append(
                    [
                        name,
                        way,
                        f"{each['cpu']:.1f}",
                        f"{each['cpu'] / base:.2f}",
                        f"{each['cpu'] / side**2 * 1e6:.2f}",
                        f"{each['wall']:.1f}",
                        f"{each['memory']:.0f}",
                        each["same"],
                    ]
                )
            path.unlink()
    print("\nFrom file to file, 5 Richardson-Lucy steps, PSF 31 x 31, float32\n")
    table(
        [
            "",
            "",
            "CPU s",
            "/ whole",
            "us per pixel",
            "elapsed s",
            "MB above the data",
            "as threads",
        ],
        rows,
    )


def measured(way: str, path: Path) -> dict[str, float]:
    done = subprocess.run(
        [sys.executable, __file__, "--case", way, str(path)], capture_output=True, text=True
    )
    if done.returncode:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


def case(way: str, path: Path) -> None:
    """One way through one photo; prints its figures."""
    import dask.array  # noqa: F401 - not to be counted
    import zarr  # noqa: F401

    psf = camera_shake(31, 5)
    # large enough that compiled loops are loaded, too
    small = np.random.default_rng(0).random((700, 800)).astype(np.float32)
    deconvolve(small, psf, LUCY)
    restore_large(small, Identity(), psf, LUCY).compute()
    before = resident("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # the peak starts anew
    start, clock = cpu(), time.perf_counter()
    output = path.with_name(f"{path.stem}-{way}{'.zarr' if way == 'zarr' else '.tif'}")
    extra = 0.0
    if way == "whole":
        photo = tifffile.imread(path)
        extra = 2 * photo.nbytes / 2**20
        tifffile.imwrite(output, deconvolve(photo, psf, LUCY))
    elif way == "cluster":
        from distributed import LocalCluster

        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
            store(
                restore_large(path, Identity(), psf, LUCY),
                output,
                scheduler=cluster.scheduler_address,
            )
    else:
        store(restore_large(path, Identity(), psf, LUCY), output)
    wall, used = time.perf_counter() - clock, cpu() - start
    peak = resident("VmHWM") - before - extra
    print(json.dumps({"cpu": used, "wall": wall, "memory": peak, "same": same(path, output)}))


def resident(name: str) -> float:
    """Memory of this process in MB: now, or at its peak."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith(name))


def cpu() -> float:
    return sum(
        getattr(resource.getrusage(who), field)
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
        for field in ("ru_utime", "ru_stime")
    )


def same(path: Path, output: Path) -> str:
    """Whether a result equals that of the threads, bit for bit."""
    reference = path.with_name(f"{path.stem}-threads.tif")
    if output == reference or output.stem.endswith("whole"):
        return "-"
    import zarr

    found = zarr.open(output)[:] if output.suffix == ".zarr" else tifffile.imread(output)
    return "yes" if np.array_equal(found, tifffile.imread(reference)) else "NO"


def table(head: list[str], rows: Iterator[list[str]] | list[list[str]]) -> None:
    print("| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    sys.stdout.flush()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--large", action="store_true", help="12 Mpx in memory, 64 Mpx in files")
    parser.add_argument("--case", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.case:
        case(arguments.case[0], Path(arguments.case[1]))
        return
    differences()
    speed(*((3000, 4000) if arguments.large else (1200, 1700)))
    if arguments.large:
        out_of_core()


if __name__ == "__main__":
    main()
