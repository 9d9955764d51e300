"""Edge detection on simulated blurred photos: recall, precision, accuracy and time.

Every scene is a grid of turned rectangles of one color each on a uniform ground, blurred by
an asymmetric path, recorded with gamma 2.2, noise and 8 bits. A true edge is found if a good
edge lies along at least a third of it. Errors are taken against the true line, displaced
as the blur displaces it: to where the noise-free profile crosses the middle of its sides.

    python benchmarks/edges.py [--large]
"""

import argparse
import time
from dataclasses import dataclass
from math import atan2, hypot, pi

import numpy as np
import scipy.fft
from scipy import ndimage, signal
from skimage.draw import polygon

from napari_crfdeblur.edges import Edge, estimate_blur_extent, find_edges

GAMMA = 2.2
OVERSAMPLED = 3
EXTENTS = (5, 10, 20, 40, 60)
NOISE = (0.002, 0.01, 0.03)


@dataclass(frozen=True)
class TrueEdge:
    start: np.ndarray
    end: np.ndarray
    sides: np.ndarray  # linear light inside and outside, (2, 3)


def path_kernel(extent):
    """A bent path of uneven speed that fills a disc of the given diameter."""
    fine, size = 4, int(np.ceil(extent)) | 1
    grid = np.zeros((size * fine,) * 2)
    t = np.linspace(0, 1, 4000)
    row, column = 0.15 + 0.7 * t, 0.5 + 0.36 * np.cos(2.6 * t)
    where = (np.stack([row, column]) * size * fine).astype(int)
    np.add.at(grid, tuple(where), 1 + 1.5 * t**2)
    grid = ndimage.gaussian_filter(grid, max(0.06 * size * fine, 2))
    y, x = np.mgrid[: size * fine, : size * fine] - (size * fine - 1) / 2
    grid *= np.hypot(y, x) < size * fine / 2
    kernel = grid.reshape(size, fine, size, fine).sum((1, 3))
    return kernel / kernel.sum()


def scene(shape, extent, rng):
    """Linear light (M, N, 3) and its true edges."""
    fine = OVERSAMPLED
    light = np.empty((shape[0] * fine, shape[1] * fine, 3), dtype=np.float32)
    ground = rng.uniform(0.1, 0.6, 3)
    light[:] = ground
    size = max(80.0, 3.2 * extent, max(shape) / 14)
    rows, columns = (int(n // (2 * size)) for n in shape)
    edges = []
    for i in range(rows * columns):
        middle = (np.array(divmod(i, columns)) + 0.5) * np.array(shape) / (rows, columns)
        height, width = size * rng.uniform(0.35, 0.55, 2)
        turn = rng.uniform(0, pi)
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        corners = np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)]) * (height, width) @ rotation
        corners += middle
        color = rng.uniform(0.03, 0.9, 3)
        inside = polygon(*(corners * fine + (fine - 1) / 2).T, light.shape[:2])
        light[inside] = color
        ends = zip(corners, np.roll(corners, -1, axis=0), strict=True)
        edges += [TrueEdge(p, q, np.stack([color, ground])) for p, q in ends]
    folded = light.reshape(shape[0], fine, shape[1], fine, 3)
    return folded.mean((1, 3)), edges


def photograph(light, kernel, noise, rng):
    pad = len(kernel) // 2
    planes = [np.pad(light[..., c], pad, mode="edge") for c in range(3)]
    blurred = np.stack([signal.oaconvolve(p, kernel, "valid") for p in planes], axis=-1)
    intensity = np.clip(blurred, 0, 1) ** (1 / GAMMA)
    intensity += noise * rng.standard_normal(intensity.shape).astype(np.float32)
    return np.rint(np.clip(intensity, 0, 1) * 255).astype(np.uint8)


def displacement(edge, normal, kernel):
    """Where the recorded profile crosses its middle, along the outward normal, pixels."""
    y, x = np.mgrid[: len(kernel), : len(kernel)] - len(kernel) // 2
    reach = (normal[0] * y + normal[1] * x).ravel()
    fine = np.arange(-len(kernel), len(kernel), 0.02)
    order = np.argsort(reach)
    # A pixel spreads each weight over about one pixel.
    share = np.interp(fine, reach[order], np.cumsum(kernel.ravel()[order]))
    share = ndimage.uniform_filter1d(share, 50, mode="nearest")
    inside, outside = edge.sides
    profile = (inside + (outside - inside) * share[:, None]) ** (1 / GAMMA)
    start, end = inside ** (1 / GAMMA), outside ** (1 / GAMMA)
    weights = (end - start) / np.abs(end - start).sum()
    level = (profile - start) @ weights / ((end - start) @ weights)
    return fine[np.argmax(level >= 0.5)]


def compare(found: Edge, true: TrueEdge, kernel, middle):
    """Share of the true edge covered, rms position error (pixels), angle error (degrees)."""
    axis = true.end - true.start
    length = np.linalg.norm(axis)
    axis = axis / length
    normal = np.array([axis[1], -axis[0]])
    ends = np.array([found.start, found.end]) - true.start
    along = np.clip(np.sort(ends @ axis), 0, length)
    across = ends @ normal
    own = np.subtract(found.end, found.start)
    angle = atan2(own[0] * axis[1] - own[1] * axis[0], own @ axis)
    angle = abs((angle + pi / 2) % pi - pi / 2)
    if np.abs(across).max() > len(kernel) or angle > 0.1:
        return 0.0, np.inf, np.inf
    outward = normal * np.sign(normal @ ((true.start + true.end) / 2 - middle))
    shift = displacement(true, outward, kernel) * (1 if outward @ normal > 0 else -1)
    rms = hypot(*(across - shift)) / np.sqrt(2)
    return np.ptp(along) / length, rms, np.degrees(angle)


def evaluate(found, truth, kernel):
    """Recall, precision, and rms errors of position and angle over all matches."""
    middles = [
        np.mean([e.start for e in truth[i - i % 4 : i - i % 4 + 4]], axis=0)
        for i in range(len(truth))
    ]
    good = [edge for edge in found if edge.good]
    matched, right, errors = set(), 0, []
    for edge in good:
        scores = [compare(edge, t, kernel, m) for t, m in zip(truth, middles, strict=True)]
        best = max(range(len(truth)), key=lambda i: scores[i][0])
        if scores[best][0] > 1 / 3:
            matched.add(best)
            right += 1
            errors.append(scores[best][1:])
    rms = np.sqrt(np.mean(np.square(errors), axis=0)) if errors else (np.nan, np.nan)
    return len(matched) / len(truth), right / max(len(good), 1), *rms


def fft_pair():
    """CPU seconds of a real FFT and back at 12 megapixels, float32, the best of 3."""
    plane = np.random.default_rng(0).standard_normal((3072, 4096), dtype=np.float32)
    return min(cpu(lambda: scipy.fft.irfft2(scipy.fft.rfft2(plane)))[0] for _ in range(3))


def cpu(call):
    start = time.process_time()
    result = call()
    return time.process_time() - start, result


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--large", action="store_true", help="12 megapixel photos")
    shape = (3072, 4096) if parser.parse_args().large else (800, 1100)
    pair = fft_pair()
    print(f"{shape[1]} x {shape[0]}; FFT pair of 4096 x 3072: {pair:.3f} s\n")
    print(
        "| blur px | noise | edges | recall | precision | position rms px | angle rms deg "
        "| found in FFT pairs | guessed extent | guessed in FFT pairs |"
    )
    print("|" + "---|" * 10)
    for extent in EXTENTS:
        kernel = path_kernel(extent)
        light, truth = scene(shape, extent, np.random.default_rng(extent))
        for noise in NOISE:
            photo = photograph(light, kernel, noise, np.random.default_rng(1))
            seconds, found = cpu(lambda p=photo, e=extent: find_edges(p, blur_extent=e))
            guessing, guess = cpu(lambda p=photo: estimate_blur_extent(p))
            recall, precision, position, angle = evaluate(found, truth, kernel)
            print(
                f"| {extent} | {noise} | {len(truth)} | {recall:.2f} | {precision:.2f} "
                f"| {position:.2f} | {angle:.2f} | {seconds / pair:.1f} | {guess:.1f} "
                f"| {guessing / pair:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
