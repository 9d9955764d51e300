"""One bright thing on dark ground, cut out of a picture: what a streak, point or bead shows."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ..._typing import BoolArray, FloatArray

SMOOTHING = 0.7  # pixels: lowers white noise to .4, and still parts streaks 3 pixels apart
# A threshold of 3 standard deviations lets one pixel in 700 of the ground pass by accident; those
# do not touch the streak, but for a few.
STANDING_OUT = 3.0
FAINT = 0.02  # of the peak: glow and reflections of a lens lie below, and little of a streak
SURE = 5.0  # standard deviations of the ground: a peak that is no noise anywhere in a box
ROUNDS = 4  # of the fit of the ground, each without what the last has shown to be none
OUTLIER = 2.5  # standard deviations
ENOUGH = 1500  # pixels of a rim: they tell its plane to a fortieth of the noise
MAD = 1.4826  # times the median absolute deviation is the standard deviation of Gaussian noise
NOTHING = 1e-12  # of light: keeps quotients finite where there is none
CONNECTED = np.ones((3, 3), dtype=bool)


@dataclass(frozen=True, slots=True, eq=False)
class Cutout:
    """The main thing in a box, and what speaks against it.

    Parameters
    ----------
    light : ndarray, shape (H, W)
        Without the ground, non-negative, zero outside of the thing.
    inside : ndarray of bool, shape (H, W)
        The thing.
    noise : float
        Standard deviation of a pixel of the ground.
    peak : float
        Of the smoothed light, in its standard deviations on the ground; 0 if nothing is there.
    clipped : float
        Share of its light in clipped pixels.
    second : float
        Light of the next thing in the box, as a share of that of this one.
    cut : float
        Brightest pixel on the border of the box, as a share of the brightest of all.
    """

    light: FloatArray
    inside: BoolArray
    noise: float
    peak: float
    clipped: float
    second: float
    cut: float

    @property
    def signal(self) -> float:
        """Signal to noise: the norm of the light in standard deviations of the ground."""
        return float(np.linalg.norm(self.light) / self.noise) if self.noise > 0 else np.inf


def cut_out(
    box: FloatArray, clipped: BoolArray | None, at: tuple[int, int] | None = None
) -> Cutout:
    """Part the main thing in a box from the ground and from other things.

    The ground is a plane fitted to the rim of the box, without what stands out there; the thing
    is what hangs together above its noise, and of several the one at a place, or that with the
    most light.

    Parameters
    ----------
    box : ndarray, shape (H, W) or (H, W, C)
        Linear light. Of color, the channels that are not clipped in the thing are added.
    clipped : ndarray of bool, the shape of `box`, optional
    at : (int, int), optional
        Row and column in the box of the thing.
    """
    planes = np.atleast_3d(np.asarray(box, dtype=np.float64))
    lost = np.zeros(planes.shape, bool) if clipped is None else clipped.reshape(planes.shape)
    first = _of_plane(planes.mean(axis=2), np.any(lost, axis=2), at)
    counts = (lost & first.inside[..., np.newaxis]).sum(axis=(0, 1))
    used = counts == counts.min()
    if used.all():
        return first
    return _of_plane(planes[..., used].mean(axis=2), np.any(lost[..., used], axis=2), at)


def _of_plane(plane: FloatArray, lost: BoolArray, at: tuple[int, int] | None) -> Cutout:
    light, noise = _without_ground(plane)
    smooth = ndimage.gaussian_filter(light, SMOOTHING, mode="nearest")
    spread = MAD * float(np.median(np.abs(smooth[_rim(plane.shape)])))
    peak = float(smooth.max() if at is None else smooth[at])
    least = max(STANDING_OUT * spread, FAINT * peak)
    labels, count = ndimage.label(smooth > least, CONNECTED)
    if not count or peak <= 0:
        nothing = np.zeros(plane.shape)
        return Cutout(nothing, nothing > 0, noise, 0.0, 0.0, 0.0, 0.0)
    sums = ndimage.sum_labels(np.maximum(light, 0), labels, np.arange(1, count + 1))
    main = int(labels[at]) if at is not None and labels[at] else int(sums.argmax()) + 1
    # What hides below the threshold at the rim of a streak is light, too.
    others = ndimage.binary_dilation((labels > 0) & (labels != main), CONNECTED)
    inside = ndimage.binary_dilation(labels == main, CONNECTED) & ~others
    own = np.where(inside, np.maximum(light, 0), 0)
    rest = np.delete(sums, main - 1).max(initial=0.0)
    second = float(rest / max(sums[main - 1], NOTHING))
    edge = _rim(plane.shape, 1) & (labels == main)
    return Cutout(
        own,
        inside,
        noise,
        peak / spread if spread > 0 else np.inf,
        float(own[lost].sum() / max(own.sum(), NOTHING)),
        second,
        float(smooth[edge].max() / peak) if edge.any() else 0.0,
    )


def _without_ground(plane: FloatArray) -> tuple[FloatArray, float]:
    """The light above a plane through the ground, and the standard deviation of the ground."""
    rows, columns = (np.linspace(-1, 1, side) for side in plane.shape)
    down, right = np.meshgrid(rows, columns, indexing="ij")
    design = np.stack([np.ones(plane.shape), down, right], axis=-1)
    on_rim = np.flatnonzero(_rim(plane.shape))
    on_rim = on_rim[:: -(-len(on_rim) // ENOUGH)]
    seen, values = design.reshape(-1, 3)[on_rim], plane.ravel()[on_rim]
    fit = np.array([np.median(values), 0.0, 0.0])
    for _ in range(ROUNDS):
        rest = values - seen @ fit
        spread = MAD * float(np.median(np.abs(rest - np.median(rest))))
        ground = np.abs(rest - np.median(rest)) <= max(OUTLIER * spread, 1e-12)
        fit, *_ = np.linalg.lstsq(seen[ground], values[ground], rcond=None)
    rest = values - seen @ fit
    return plane - design @ fit, MAD * float(np.median(np.abs(rest - np.median(rest))))


def _rim(shape: tuple[int, ...], width: int | None = None) -> BoolArray:
    """Where the rim of a box is: an eighth of its shorter side, or so many pixels."""
    width = max(1, min(shape) // 8) if width is None else width
    rim = np.ones(shape, dtype=bool)
    rim[width:-width, width:-width] = False
    return rim
