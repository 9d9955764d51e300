"""Evaluation cases for estimates of the camera response from pictures, drawn from seeds.

Three suites are functions from a number, 0 or more, to a ``Case``: the same number gives the same
case, any run of successive numbers mixes what the suite varies, and nothing is kept in memory.

``panels``
    Painted walls whose edges are straight, but not all good; see the function for what is drawn.
    Responses of DoRF.
``pictures``
    Photographs and real camera shakes, responses of DoRF.
``cameras``
    The same with the responses of digital cameras, measured from their own raw and JPEG files.

The photographs, the shakes and the measurements are in ``../shared/data`` beside the repository;
without it only ``panels`` works, with random EMoR curves in place of DoRF. Every photo is taken by
``simulate`` and has no border of unknown blur. Run as a script, this shows one line for each case::

    OMP_NUM_THREADS=1 python benchmarks/suites.py panels --count 10
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from math import cos, pi, sin
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage
from scipy.interpolate import BSpline
from scipy.io import loadmat
from scipy.optimize import isotonic_regression, nnls

from napari_crfdeblur.psf.base import as_psf
from napari_crfdeblur.psf.shapes import camera_shake
from napari_crfdeblur.response import SRGB, Emor, ResponseCurve, Tabulated
from napari_crfdeblur.response.prior import DORF_DEVIATIONS
from napari_crfdeblur.simulate import Camera, Scene, simulate
from napari_crfdeblur.simulate.raster import paint

Floats = NDArray[np.floating]
Color = NDArray[np.floating]  # irradiance of red, green and blue
Pair = tuple[float, float]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
JPEG = 95

PICTURE_CURVES = 20  # of DoRF, drawn once, for `pictures`
PICTURE_NOISE = 0.002
SCALES = (0.5, 0.75, 1.0)  # of the measured shakes
SMOOTHING = 0.35  # of the curves of digital cameras
BEYOND = 0.25  # of the brightest patch: how far white can lie
SENSOR = (1080, 1920)  # of the raw exposure


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A blurred photo and everything that made it.

    Parameters
    ----------
    name : str
        Suite, number, and what the case is made of.
    number : int
        Its number in the suite.
    photo : ndarray, shape (M, N, 3)
        uint8, blurred, noisy, through JPEG.
    truth : ResponseCurve
        The response of all three channels.
    psf : ndarray, shape (H, W)
        The blur, sum 1.
    sharp_linear : ndarray, shape (M, N, 3)
        Irradiance without blur, float32 in [0, 1].
    sharp : ndarray, shape (M, N, 3)
        The same as the camera would have recorded it, uint8: what to hope for.
    extent : float
        Longest side of the PSF, px; see ``extent``.
    noise : float
        Standard deviation of the noise in irradiance.
    """

    name: str
    number: int
    photo: NDArray[np.uint8]
    truth: ResponseCurve
    psf: Floats
    sharp_linear: Floats
    sharp: NDArray[np.uint8]
    extent: float
    noise: float


def taken(name: str, number: int, linear: Floats, psf: Floats, camera: Camera) -> Case:
    shot = simulate(Scene(linear), psf, camera, seed=number)
    return Case(
        name=name,
        number=number,
        photo=shot.photo,
        truth=camera.response,
        psf=shot.psf,
        sharp_linear=shot.sharp_linear,
        sharp=shot.sharp,
        extent=extent(shot.psf),
        noise=camera.noise,
    )


def extent(psf: Floats) -> float:
    """Longer side, px, of the box around what is brighter than a 50th of the peak."""
    places = np.argwhere(psf > psf.max() / 50)
    return float(np.ptp(places, axis=0).max() + 1)


def stream(suite: str, number: int) -> np.random.Generator:
    """Random numbers for one case of one suite."""
    return np.random.default_rng([*suite.encode(), number])


# Responses


@cache
def dorf_curves() -> tuple[ResponseCurve, ...]:
    """The 201 responses of DoRF; without the data, random EMoR curves."""
    path = DATA / "response" / "dorf_201.mat"
    if not path.exists():
        return random_curves()
    table = loadmat(path)
    return tuple(rising(*pair) for pair in zip(table["I"], table["B"], strict=True))


def rising(light: Floats, intensity: Floats) -> Tabulated:
    """A measured curve with the slightest slope where it is flat, so that it has an inverse."""
    light = light.astype(float)
    return Tabulated(irradiance=light, intensity=(intensity + 1e-6 * light) / (1 + 1e-6))


def random_curves(count: int = 201) -> tuple[ResponseCurve, ...]:
    """EMoR curves with the coefficients of DoRF's spread."""
    rng = stream("random curves", 0)
    curves: list[ResponseCurve] = []
    while len(curves) < count:
        try:
            curves.append(Emor(tuple(rng.normal(scale=DORF_DEVIATIONS))))
        except ValueError:  # not strictly increasing
            continue
    return tuple(curves)


@cache
def picture_curves() -> tuple[tuple[str, ResponseCurve], ...]:
    """The responses of ``pictures``, with their number in DoRF."""
    numbers = stream("curves", 0).choice(len(dorf_curves()), PICTURE_CURVES, replace=False)
    return tuple((f"DoRF {n}", dorf_curves()[n]) for n in numbers.tolist())


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """Gray patches of one camera: what was exposed and what was recorded.

    Parameters
    ----------
    raw, jpeg : ndarray, shape (8, 6, 3)
        Means in [0, 1], by shot (4 exposures under each of 2 illuminants), patch and channel.
    """

    raw: Floats
    jpeg: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """The response of a camera, fitted to its gray patches.

    Parameters
    ----------
    name : str
        Of the camera.
    curve : Tabulated
        One for all channels: they agree once each is balanced.
    light, intensity : ndarray, shape (K, 3)
        The patches that were used: balanced light, 1 at the white point, and what was recorded;
        nan where the raw was saturated.
    """

    name: str
    curve: Tabulated
    light: Floats
    intensity: Floats

    @property
    def misses(self) -> Floats:
        """Recorded less predicted intensity, (K, 3); nan where there is no patch."""
        return self.intensity - self.curve.to_intensity(self.light)

    @property
    def residual(self) -> float:
        """Root mean square of the misses."""
        return float(np.sqrt(np.nanmean(self.misses**2)))


def digital_curves() -> list[tuple[str, ResponseCurve]]:
    """Responses of the cameras of ``camera_pairs`` by name."""
    return [(camera.name, camera.curve) for camera in measured_cameras()]


@cache
def measured_cameras() -> tuple[Measured, ...]:
    folders = sorted(path for path in (DATA / "camera_pairs").iterdir() if path.is_dir())
    return tuple(fitted(folder.name, gray_patches(folder)) for folder in folders)


def gray_patches(folder: Path) -> Patches:
    """Means of the gray patches: the last row of six of the chart, which fills each picture."""
    raw, jpeg = (
        np.array([patch_means(folder, i, e, kind) for i in (1, 2) for e in (1, 2, 3, 4)])
        for kind in ("raw", "jpg")
    )
    return Patches(raw, jpeg)


def patch_means(folder: Path, illuminant: int, exposure: int, kind: str) -> Floats:
    """Means of 24 x 24 px in the middle of six patches, shape (6, 3)."""
    name = f"wb1i{illuminant}e{exposure}-{kind}.png"
    picture = np.asarray(Image.open(folder / name).convert("RGB"), dtype=float) / 255
    rows, columns = picture.shape[:2]
    middle = round(rows * 7 / 8)
    places = np.round(columns * (np.arange(6) + 0.5) / 6).astype(int)
    return np.array(
        [picture[middle - 12 : middle + 12, x - 12 : x + 12].mean(axis=(0, 1)) for x in places]
    )


def fitted(name: str, patches: Patches, rounds: int = 20) -> Measured:
    """A rising curve through the patches, and the white balance that makes them agree.

    A raw file comes before the white balance: in each shot red and blue have a gain of their own.
    Green has one for each illuminant, 1 under the first. Curve and gains are found in turn.
    Saturated raw values are left out.
    """
    saturated = patches.raw > 0.97
    light = np.where(saturated, np.nan, patches.raw)
    gains = np.ones((8, 1, 3))
    trials = np.exp(np.linspace(-0.1, 0.1, 41))
    for _ in range(rounds):
        through = rising_through(light * gains, patches.jpeg)
        misses = [
            np.nanmean((through(light * gains * t) - patches.jpeg) ** 2, axis=1, keepdims=True)
            for t in trials
        ]
        gains = gains * trials[np.argmin(misses, axis=0)]
        green = np.log(gains[:, 0, 1]).reshape(2, 4).mean(axis=1)
        gains[:, 0, 1] = np.repeat(np.exp(green - green[0]), 4)
    balanced = light * gains
    curve, white = smooth_curve(balanced, patches.jpeg)
    intensity = np.where(saturated, np.nan, patches.jpeg)
    return Measured(name, curve, (balanced / white).reshape(-1, 3), intensity.reshape(-1, 3))


def rising_through(light: Floats, intensity: Floats) -> Callable[[Floats], Floats]:
    """Straight lines through the isotonic regression of the patches; nan stays nan."""
    used = np.isfinite(light)
    order = np.argsort(light[used])
    x, y = light[used][order], isotonic_regression(intensity[used][order]).x

    def predict(values: Floats) -> Floats:
        return np.where(np.isfinite(values), np.interp(values, x, y), np.nan)

    return predict


def smooth_curve(light: Floats, intensity: Floats) -> tuple[Tabulated, float]:
    """A smooth rising curve near the patches, and the light, on their scale, of its white.

    Where the brightest patch is recorded darker than 1, the curve goes on straight.
    """
    used = np.isfinite(light)
    brightest = float(light[used].max())
    root = np.linspace(0, 1, 1025)
    values = smooth_spline(np.sqrt(light[used] / brightest), intensity[used])(root)
    x, y = root**2, values + 1e-4 * root
    if y[-1] < 1:
        slope = (y[-1] - y[-65]) / (x[-1] - x[-65])
        rest = min((1 - y[-1]) / slope, BEYOND)
        x, y = np.append(x, x[-1] + rest), np.append(y, 1.0)
    curve = Tabulated(irradiance=x / x[-1], intensity=y / y[-1])
    return curve, brightest * float(x[-1])


def smooth_spline(root: Floats, intensity: Floats, parts: int = 24) -> BSpline:
    """A cubic spline that rises over [0, 1] from (0, 0), of equal parts of the root of the light.

    Over the root a response is nearly straight but for its beginning, which is a parabola where
    the response has a slope. Coefficients that rise make a spline that rises; as steps of 0 or
    more they are found by least squares, with a penalty on their third differences that holds the
    curve across gaps and leaves it free elsewhere.
    """
    knots = np.concatenate([[0] * 3, np.linspace(0, 1, parts + 1), [1] * 3])
    steps = np.tri(parts + 3)[:, 2:]  # the first two coefficients are 0
    basis = BSpline.design_matrix(np.clip(root, 0, 1), knots, 3).toarray()
    weight = SMOOTHING * np.sqrt(root.size)
    rows = np.concatenate([basis @ steps, weight * np.diff(steps, n=3, axis=0)])
    found, _ = nnls(rows, np.concatenate([intensity, np.zeros(parts)]))
    return BSpline(knots, steps @ found, 3)


# Photographs


def pictures(number: int) -> Case:
    """A photograph under a measured camera shake, recorded with a response of DoRF.

    12 film scans of 768 x 512 px, whose sRGB values are undone, and a raw exposure of a test chart,
    binned 2 x 2, whose green is clipped over a sixth of the picture; 8 shakes of Levin et al. 2009
    at 3 sizes; 20 responses; noise of .002 in irradiance.
    """
    choice = stream("pictures", number).integers(PICTURE_CURVES)
    return picture_case("pictures", number, picture_curves()[choice])


def cameras(number: int) -> Case:
    """As ``pictures``, with the response of a digital camera."""
    curves = digital_curves()
    return picture_case("cameras", number, curves[number % len(curves)])


def picture_case(suite: str, number: int, response: tuple[str, ResponseCurve]) -> Case:
    # The numbers of pictures, shakes and sizes have no common divisor: all combinations occur.
    sources = photographs()
    source = sources[number % len(sources)]
    shakes = measured_shakes()
    shake, size = number % len(shakes), SCALES[number % len(SCALES)]
    label, curve = response
    name = f"{suite} {number}: {source.stem}, shake {shake + 1} x {size}, {label}"
    camera = Camera(curve, noise=PICTURE_NOISE, jpeg=JPEG)
    return taken(name, number, linear_light(source), resized(shakes[shake], size), camera)


@cache
def photographs() -> tuple[Path, ...]:
    return (*sorted((DATA / "sharp").glob("*.png")), DATA / "linear" / "openisp_test.RAW")


def linear_light(path: Path) -> Floats:
    """Linear scene, shape (M, N, 3), of a photo in sRGB or of a raw file."""
    if path.suffix == ".png":
        intensity = np.asarray(Image.open(path).convert("RGB"), dtype=np.float32) / 255
        return SRGB().to_irradiance(intensity).astype(np.float32)
    mosaic = np.fromfile(path, "<u2").reshape(SENSOR).astype(np.float32)
    mosaic /= mosaic.max()  # where it is clipped; its black is 0
    green = (mosaic[::2, 1::2] + mosaic[1::2, ::2]) / 2
    return np.stack([mosaic[::2, ::2], green, mosaic[1::2, 1::2]], axis=-1)


@cache
def measured_shakes() -> tuple[Floats, ...]:
    """The 8 shakes of Levin et al. 2009, as convolution kernels."""
    files = sorted((DATA / "levin2009").glob("im01_ker*.mat"))
    return tuple(np.rot90(loadmat(file)["f"], 2) for file in files)


def resized(psf: Floats, scale: float) -> Floats:
    """A PSF of another size, with odd sides."""
    if scale == 1:
        return as_psf(psf)
    smaller = ndimage.zoom(psf, scale, order=1, mode="grid-constant", grid_mode=True)
    return as_psf(np.pad(smaller, [(0, 1 - side % 2) for side in smaller.shape]))


# Panels


def panels(number: int) -> Case:
    """A painted street of walls with windows, doors and posters, under a simulated camera shake.

    1 to 3 megapixels, a shake of 11 to 35 px, noise of .002 to .005, a response of DoRF.

    Two to four walls stand side by side over a pavement, each with a tilt, a color and light of its
    own: sun, or for 40 % of them a shade of 25 to 60 %. A wall has a grid of equal windows, frame
    and pane, which makes many edges between the same three colors; and 3 to 8 posters, most of them
    slightly tilted, the others by any angle, which overlap and carry up to three smaller shapes,
    often smaller than the blur.

    Colors are drawn as people see them, by hue, saturation (a third on average) and brightness (.3
    to 1), so that the channels of an edge go together; a third of all is gray, and most window
    frames and pavements. A third of the posters, half of the walls and 70 % of the pavements are
    textured - stripes, bricks, blotches of many sizes - and spoil the edges on them. Plain areas
    are lit unevenly, by 1 to 6 % across the picture, and have a grain of .5 %, as paint has. The
    exposure puts the brightest half percent at .75 to 1.03 of white: now and then something clips.

    About a third of the edges that are found are good, some 90 in a picture.
    """
    rng = stream("panels", number)
    size = 2 * int(rng.integers(5, 18)) + 1
    psf = camera_shake(size, int(rng.integers(2**31)))
    pixels, ratio = 1e6 * rng.uniform(1, 3), rng.uniform(0.62, 0.8)
    shape = round(np.sqrt(pixels * ratio)), round(np.sqrt(pixels / ratio))
    if rng.uniform() < 0.3:
        shape = shape[1], shape[0]
    curves = dorf_curves()
    choice = int(rng.integers(len(curves)))
    noise = float(rng.uniform(0.002, 0.005))
    linear = street_of_panels((shape[0] + size, shape[1] + size), rng)
    name = f"panels {number}: shake {size}, DoRF {choice}, noise {noise:.4f}"
    return taken(name, number, linear, psf, Camera(curves[choice], noise=noise, jpeg=JPEG))


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """Where things on a wall lie: turned about a point, slightly keystoned.

    Parameters
    ----------
    origin : (float, float)
        (row, column) of the middle of the wall, px.
    angle : float
        Tilt, radians.
    unit : float
        Length 1 on the wall, px.
    keystone : float
        By how much the columns draw together at height 1.
    """

    origin: Pair
    angle: float
    unit: float
    keystone: float = 0.0

    def corners(self, box: tuple[float, float, float, float], angle: float = 0.0) -> Floats:
        """Corners, shape (4, 2) px, of a box (middle down, right; height, width), itself turned."""
        down, right, height, width = box
        signs = np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)]) / 2
        own = signs * [height, width] @ turned(angle) + [down, right]
        own[:, 1] *= 1 + self.keystone * own[:, 0]
        return own @ turned(self.angle) * self.unit + self.origin


def turned(angle: float) -> Floats:
    return np.array([[cos(angle), sin(angle)], [-sin(angle), cos(angle)]])


def street_of_panels(shape: tuple[int, int], rng: np.random.Generator) -> Floats:
    """Irradiance, shape (M, N, 3), float32."""
    canvas = np.empty((*shape, 3), dtype=np.float32)
    rows, columns = shape
    canvas[:] = color(rng)  # the sky, where walls leave it
    count = int(rng.integers(2, 5))
    shares = np.cumsum(rng.uniform(0.7, 1.3, size=count + 1))
    joints = columns * (shares[:-1] - shares[0]) / (shares[-1] - shares[0])
    for left, right in zip(joints, [*joints[1:], 1.05 * columns], strict=True):
        wall(canvas, (left, right), rng)
    ground = rows * rng.uniform(0.86, 0.95)
    slope = rng.uniform(-0.05, 0.05) * rows
    pavement = [(ground, -9), (ground + slope, columns + 9), (2 * rows, columns), (2 * rows, -9)]
    textured(canvas, np.array(pavement), color(rng, gray=0.8), rng, share=0.7)
    return lit(canvas, rng)


def wall(canvas: Floats, span: Pair, rng: np.random.Generator) -> None:
    """A wall over a span of columns, with windows or doors, and posters."""
    rows, left, right = canvas.shape[0], *span
    light = 1.0 if rng.uniform() < 0.6 else rng.uniform(0.25, 0.6)
    unit = 0.5 * (right - left) + 0.25 * rows
    frame = Frame(
        (0.5 * rows, (left + right) / 2), rng.normal(0, 0.1), unit, rng.uniform(-0.15, 0.15)
    )
    top = rng.uniform(-0.1, 0.12) * rows
    lean = rng.normal(0, 0.03, size=2) * rows
    outline = [(top, left + lean[0]), (top + lean[1], right + 9), (2 * rows, right + 9)]
    outline.append((2 * rows, left))
    textured(canvas, np.array(outline), light * color(rng), rng, share=0.5)
    windows(canvas, frame, (0.5 * (right - left) / unit, 0.5 * rows / unit), light, rng)
    for _ in range(int(rng.integers(3, 9))):
        place = rng.uniform(-0.85, 0.85, size=2) * [0.5 * rows / unit, 0.5 * (right - left) / unit]
        poster(canvas, frame, place, light, rng)


def windows(
    canvas: Floats, frame: Frame, half: Pair, light: float, rng: np.random.Generator
) -> None:
    """A grid of equal windows: a frame, a dark or bright pane, sometimes a bar across."""
    framing, pane = light * color(rng, gray=0.7, dark=0.3), light * color(rng, gray=0.5)
    pane *= rng.choice([0.15, 0.5, 1.0])
    pitch = rng.uniform(0.35, 0.6)
    height, width = pitch * rng.uniform(0.4, 0.75), pitch * rng.uniform(0.35, 0.65)
    border, bar = rng.uniform(0.01, 0.12) * width, rng.uniform() < 0.5
    present = rng.uniform(0.4, 1.0)
    for down in np.arange(-half[1] + 0.5 * pitch, half[1], pitch):
        for right in np.arange(-half[0] + 0.5 * pitch, half[0], pitch):
            if rng.uniform() > present:
                continue
            paint(canvas, [frame.corners((down, right, height, width))], framing)
            inner = height - 2 * border, width - 2 * border
            paint(canvas, [frame.corners((down, right, *inner))], pane)
            if bar:
                paint(canvas, [frame.corners((down, right, height, border))], framing)


def poster(
    canvas: Floats, frame: Frame, place: Floats, light: float, rng: np.random.Generator
) -> None:
    """A panel of any tilt, mostly slight, with two or three shapes on it."""
    slight = rng.uniform() < 0.6
    angle = rng.normal(0, 0.12) if slight else rng.uniform(0, pi)
    side = rng.uniform(0.18, 0.5)
    height, width = side, side * rng.uniform(0.6, 1.5)
    own = Frame(
        tuple(frame.corners((*place, 0, 0))[0].tolist()), frame.angle + angle, frame.unit, 0
    )
    corners = own.corners((0, 0, height, width))
    corners += rng.normal(0, 0.01 * side * frame.unit, size=(4, 2))  # seen aslant
    textured(canvas, corners, light * color(rng), rng, share=0.33)
    for _ in range(int(rng.integers(0, 4))):
        middle = rng.uniform(-0.3, 0.3, size=2) * [height, width]
        sides = rng.uniform(0.05, 0.45, size=2) * [height, width]
        turn = 0.0 if rng.uniform() < 0.7 else rng.uniform(0, pi)
        paint(canvas, [own.corners((*middle, *sides), turn)], light * color(rng))


def textured(
    canvas: Floats, outline: Floats, value: Color, rng: np.random.Generator, *, share: float
) -> None:
    """Paint an area, plain or, in `share` of the cases, with a texture over it."""
    before = canvas.copy()
    paint(canvas, [outline], value)
    if rng.uniform() >= share:
        return
    low = np.maximum(np.floor(outline.min(axis=0)), 0).astype(int)
    high = np.minimum(np.ceil(outline.max(axis=0)) + 1, canvas.shape[:2]).astype(int)
    if np.any(low >= high):
        return
    box = slice(low[0], high[0]), slice(low[1], high[1])
    cover = np.zeros(canvas[box].shape[:2], dtype=np.float32)
    paint(cover, [outline - low], 1.0)
    strength = rng.uniform(0.03, 0.25)
    pattern = texture((cover.shape[0], cover.shape[1]), rng)
    painted = value * np.exp(strength * pattern)[..., np.newaxis]
    canvas[box] = before[box] + cover[..., np.newaxis] * (painted - before[box])


def texture(shape: tuple[int, int], rng: np.random.Generator) -> Floats:
    """Blotches, stripes or bricks of mean 0 and deviation about 1, shape `shape`."""
    kind = rng.integers(3)
    if kind == 0:
        return blotches(shape, rng.uniform(0.8, 12), rng)
    angle, period = rng.choice([0, pi / 2, rng.uniform(0, pi)]), rng.uniform(6, 60)
    rows, columns = np.indices(shape, dtype=np.float32)
    across = (rows * cos(angle) + columns * sin(angle)) / period
    if kind == 1:
        return np.sign(np.sin(2 * pi * across))
    along = (columns * cos(angle) - rows * sin(angle)) / (3 * period) + np.floor(across) / 2
    joints = (across % 1 < 0.12) | (along % 1 < 0.04)
    tone = rng.standard_normal(4096)[
        (np.floor(across) * 57 + np.floor(along) * 13).astype(int) % 4096
    ]
    return np.where(joints, 2.0, 0.4 * tone)


def blotches(shape: tuple[int, int], size: float, rng: np.random.Generator) -> Floats:
    """Smooth noise of deviation 1 whose blotches measure about `size` px."""
    step = max(1, int(size / 2))
    coarse = [side // step + 2 for side in shape]
    noise = ndimage.gaussian_filter(rng.standard_normal(coarse), size / step)
    large = ndimage.zoom(noise, step, order=1) if step > 1 else noise
    result: Floats = large[: shape[0], : shape[1]] / noise.std()
    return result


def lit(canvas: Floats, rng: np.random.Generator) -> Floats:
    """The scene under light that varies slowly, with the grain of its surfaces, exposed."""
    rows, columns = canvas.shape[:2]
    down, right = (np.linspace(-1, 1, side) for side in (rows, columns))
    angle, fall = rng.uniform(0, 2 * pi), rng.uniform(0.01, 0.06)
    light = 1 + 0.5 * fall * (cos(angle) * down[:, np.newaxis] + sin(angle) * right)
    light = light * (1 + 0.005 * blotches((rows, columns), 1.0, rng))
    exposed = canvas * light[..., np.newaxis]
    exposed *= rng.uniform(0.75, 1.03) / np.quantile(exposed, 0.995)
    return np.clip(exposed, 0, 1).astype(np.float32)


def color(rng: np.random.Generator, *, gray: float = 0.33, dark: float = 0.0) -> Color:
    """Irradiance of a paint by daylight, shape (3,), gray with a probability of `gray`.

    Hue, saturation and brightness, at least `dark`, are drawn as seen, hence in sRGB. No paint is
    quite black or white: 3 to 92 % of the light come back.
    """
    saturation = 0.03 * rng.uniform() if rng.uniform() < gray else rng.beta(1.5, 3)
    brightness = rng.uniform(max(0.3, dark), 1.0)
    hue = (rng.uniform() + np.arange(3) / 3) % 1
    ramp = np.clip(np.abs(6 * hue - 3) - 1, 0, 1)
    seen = brightness * (1 - saturation * (1 - ramp))
    return 0.03 + 0.89 * np.asarray(SRGB().to_irradiance(seen))


SUITES: dict[str, Callable[[int], Case]] = {
    "panels": panels,
    "pictures": pictures,
    "cameras": cameras,
}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("suite", choices=SUITES)
    parser.add_argument("--count", type=int, default=10, metavar="N", help="the first N cases")
    options = parser.parse_args(arguments)
    for number in range(options.count):
        case = SUITES[options.suite](number)
        print(f"{case.name}; {case.photo.shape}, extent {case.extent:.0f}")


if __name__ == "__main__":
    main()
