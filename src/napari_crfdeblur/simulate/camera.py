"""From a scene to a photo: blur, noise, response, quantization, compression."""

from dataclasses import dataclass
from io import BytesIO
from math import inf

import numpy as np

from .. import arguments, fourier
from .._typing import FloatArray, Image
from ..photo import from_unit
from ..psf.base import as_planar_psf
from ..response import ResponseCurve, reapply
from .motion import CameraMotion
from .scenes import Scene, TrueEdge

MOST_PHOTONS = 1e30  # that single precision holds; infinity stands for more
NOISIEST = 1e6  # noise in irradiance, beside which no light is seen


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera: ``B = f(E + n)``, rounded to integers (Kim et al. 2012).

    The noise `n` is Gaussian with variance ``noise^2 + E / photons`` and enters before the
    response `f`.

    Parameters
    ----------
    response : ResponseCurve
        `f`, one for all channels.
    noise : float
        Standard deviation of the read noise, in irradiance.
    photons : float
        Photons that make irradiance 1; infinity for no photon noise.
    bits : int or None
        8 or 16; None records float32 without rounding.
    jpeg : int or None
        Quality, 1 to 100, of JPEG compression (color at half resolution); 8 bits only.
    """

    response: ResponseCurve
    noise: float = 0.0
    photons: float = inf
    bits: int | None = 8
    jpeg: int | None = None

    def __post_init__(self) -> None:
        arguments.instance(self.response, ResponseCurve, "a response curve")
        arguments.number(self.noise, "noise", least=0, most=NOISIEST)
        if not (isinstance(self.photons, float) and self.photons == inf):
            arguments.number(self.photons, "photons", least=1 / NOISIEST, most=MOST_PHOTONS)
        if self.bits is not None and arguments.whole(self.bits, "8 or 16 bits") not in (8, 16):
            raise arguments.refusal("8 or 16 bits or None", self.bits)
        if self.jpeg is not None:
            arguments.whole(self.jpeg, "a JPEG quality", least=1, most=100)
            if self.bits != 8:
                raise arguments.refusal("8 bits for JPEG compression", self.bits)

    @property
    def dtype(self) -> np.dtype[np.generic]:
        """Kind of number of its photos."""
        return np.dtype(np.float32 if self.bits is None else f"uint{self.bits}")

    @property
    def step(self) -> float:
        """Difference between two neighboring recorded intensities; 0 without rounding."""
        return 0.0 if self.bits is None else 1 / (2**self.bits - 1)

    def expose(self, irradiance: FloatArray, rng: np.random.Generator) -> Image:
        """Record light as a photo of its shape, without compression."""
        return from_unit(self.response.to_intensity(self.noisy(irradiance, rng)), self.dtype)

    def noisy(self, irradiance: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Light with the noise of one exposure, shape of `irradiance`; can leave [0, 1]."""
        deviation = np.sqrt(self.noise_variance(irradiance)).astype(np.float32)
        if not deviation.any():
            return irradiance
        return irradiance + deviation * rng.standard_normal(irradiance.shape, dtype=np.float32)

    def noise_variance(self, irradiance: FloatArray) -> FloatArray:
        """Variance of the noise, in irradiance, where the light is `irradiance`."""
        return np.asarray(self.noise**2 + np.maximum(irradiance, 0) / self.photons)


@dataclass(frozen=True, slots=True, eq=False)
class Simulated:
    """A simulated photo together with everything that made it.

    Parameters
    ----------
    photo : ndarray, shape (M, N) or (M, N, 3)
        The blurred, noisy recording: uint8, uint16 or float32.
    sharp : ndarray, shape of `photo`
        The same without blur and noise, through the same response: what to hope for.
    sharp_linear, blurred_linear : ndarray, shape of `photo`
        Irradiance before the response without blur, and with it but without noise; float32.
    psf : ndarray, shape (H, W)
        The blur, or that in the middle of the photo, both sides odd, sum 1.
    camera : Camera
        The camera, with the true response.
    edges : tuple of TrueEdge
        The edges of the scene, in pixels of the photo; they can reach beyond it.
    seed : int
        Seed of the noise.
    motion : CameraMotion, optional
        How the camera turned; None if it did not.
    """

    photo: Image
    sharp: Image
    sharp_linear: FloatArray
    blurred_linear: FloatArray
    psf: FloatArray
    camera: Camera
    edges: tuple[TrueEdge, ...]
    seed: int
    motion: CameraMotion | None = None

    def __post_init__(self) -> None:
        for name in ("photo", "sharp", "sharp_linear", "blurred_linear", "psf"):
            getattr(self, name).setflags(write=False)


def simulate(
    scene: Scene, psf: FloatArray | CameraMotion, camera: Camera, *, seed: int = 0
) -> Simulated:
    """Take a blurred photo of a scene.

    Only pixels whose blur is known in full are kept, so that the borders are those of a real
    photo: it is smaller than the scene by the PSF, ``(M - H + 1, N - W + 1)``, or by the reach
    of the motion.

    Parameters
    ----------
    scene : Scene
        What the camera looks at, shape (M, N) or (M, N, 3).
    psf : ndarray, shape (H, W), or CameraMotion
        Point spread function, non-negative; scaled to sum 1, origin at ``side // 2``. A camera
        that turns has another one everywhere.
    camera : Camera
        How the light is recorded.
    seed : int
        Seed of the noise: the same seed gives the same photo.
    """
    arguments.instance(scene, Scene, "a Scene")
    arguments.instance(camera, Camera, "a Camera")
    arguments.whole(seed, "a seed", least=0)
    if not isinstance(psf, CameraMotion):
        psf = arguments.addable(psf, "a PSF (H, W) or a CameraMotion")
    motion = psf if isinstance(psf, CameraMotion) else None
    middle = as_planar_psf(psf.psf_at((0.0, 0.0)) if isinstance(psf, CameraMotion) else psf)
    sides = scene.linear.shape[0], scene.linear.shape[1]
    reach = motion.reach(sides) if motion else (middle.shape[0] // 2, middle.shape[1] // 2)
    if 2 * reach[0] >= sides[0] or 2 * reach[1] >= sides[1]:
        raise ValueError(
            f"expected a scene larger than the PSF {middle.shape}, got {scene.linear.shape}"
        )
    sharp = _inner(scene.linear, reach).copy()
    whole = motion.blurred(scene.linear) if motion else _blur(scene.linear, middle)
    blurred = _inner(whole, reach).copy()
    noisy = camera.noisy(blurred, np.random.default_rng(seed))
    photo = reapply(noisy, camera.response, camera.dtype)
    return Simulated(
        photo=photo if camera.jpeg is None else _compressed(photo, camera.jpeg),
        sharp=reapply(sharp, camera.response, camera.dtype),
        sharp_linear=sharp,
        blurred_linear=blurred,
        psf=middle,
        camera=camera,
        edges=tuple(edge.moved(-reach[0], -reach[1]) for edge in scene.edges),
        seed=seed,
        motion=motion,
    )


def _inner(image: FloatArray, reach: tuple[int, int]) -> FloatArray:
    rows, columns = image.shape[:2]
    return image[reach[0] : rows - reach[0], reach[1] : columns - reach[1]]


def _blur(linear: FloatArray, psf: FloatArray) -> FloatArray:
    """Circular convolution of every channel; right where the PSF does not reach a border."""
    shape = fourier.fast_shape((linear.shape[0], linear.shape[1]))
    transfer = fourier.otf(psf, shape)
    blurred = np.empty_like(linear)
    for channel in np.ndindex(linear.shape[2:]):
        plane = np.zeros(shape, dtype=np.float32)
        plane[: linear.shape[0], : linear.shape[1]] = linear[:, :, *channel]
        spectrum = fourier.forward(plane) * transfer
        result = fourier.inverse(spectrum, shape)
        blurred[:, :, *channel] = result[: linear.shape[0], : linear.shape[1]]
    return np.clip(blurred, 0, 1, out=blurred)  # rounding can leave it by 1e-7


def _compressed(photo: Image, quality: int) -> Image:
    from PIL import Image as Pillow

    stream = BytesIO()
    Pillow.fromarray(photo).save(stream, format="JPEG", quality=int(quality))
    return np.array(Pillow.open(stream))
