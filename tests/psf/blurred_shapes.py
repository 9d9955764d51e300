"""Photos of known blur, drawn: many shapes with sharp sides."""

import numpy as np
from scipy.signal import fftconvolve

from napari_crfdeblur._typing import FloatArray


def scene(rows: int, columns: int, seed: int = 4) -> FloatArray:
    """Tilted ellipses and squares of any size and gray, one before the other."""
    random = np.random.default_rng(seed)
    down, right = np.indices((rows, columns), dtype=np.float64)
    picture = np.full((rows, columns), 0.5)
    for number in range(rows * columns // 600):
        y, x, angle = random.uniform([0, 0, 0], [rows, columns, np.pi])
        radii, power = random.uniform(6, 30, 2), (2, 12)[number % 2]
        along = (down - y) * np.sin(angle) + (right - x) * np.cos(angle)
        across = (down - y) * np.cos(angle) - (right - x) * np.sin(angle)
        inside = (along / radii[0]) ** power + (across / radii[1]) ** power < 1
        picture[inside] = random.uniform(0.05, 0.95)
    return picture


def blurred(psf: FloatArray, rows: int, columns: int, noise: float = 0.003) -> FloatArray:
    sharp = scene(rows + psf.shape[0] - 1, columns + psf.shape[1] - 1)
    clean = fftconvolve(sharp, psf, mode="valid")
    return np.asarray(clean + np.random.default_rng(1).normal(0, noise, clean.shape))
