"""What was recorded and what was not: the gap beyond the border, and saturated pixels.

Transforms need light in every pixel of a periodic plane. Where none was recorded it is either
filled in, again and again, or masked out of the equations.
"""

from typing import Protocol

from .. import arrays
from .._typing import BoolArray, FloatArray
from ..boundary import Band, banding, extending, frame
from ..fourier import (
    ComplexArray,
    convolving,
    correlating,
    forward,
    inverse,
    kept_otf,
    multiply_conjugate,
    power,
)
from ..progress import Job, Progress
from .highlights import filling

# Of the change: fillings converge for any factor below 2, and are slow at 1, since blur passes
# little of the fine details on.
RELAXATION = 1.8


class Recorded:
    """The data of least squares on a periodic plane, ``|K|^2`` and ``k' * y``; its gap.

    Majorize-minimize: filled into the gap is what the sharp picture found so far would have
    recorded there, which then attracts nothing.

    Parameters
    ----------
    extended : ndarray
        Periodic continuation of the blurred plane, with a first guess in the gap.
    gain : ndarray
        ``|K|^2``, half spectrum.
    correlated : ndarray
        ``k' * y`` of `extended`, half spectrum.
    sides : list of Band
        The gap.
    """

    def __init__(
        self,
        extended: FloatArray,
        gain: FloatArray,
        correlated: ComplexArray,
        sides: list[Band],
    ) -> None:
        self.gain, self.correlated, self.bands = gain, correlated, sides
        self.first = [arrays.copy(band.gap_of(extended)) for band in sides]
        self.change = [0 * each for each in self.first]
        self.filled = False

    def filling(self, sharp: FloatArray, at: Progress) -> Job[None]:
        """Job: compare with what the sharp picture would have recorded in the gap."""
        self.filled = True
        for band, first, change in zip(self.bands, self.first, self.change, strict=True):
            recorded = yield from band.blurring(sharp, at)
            change += RELAXATION * (recorded - first - change)

    def completing(self, picture: FloatArray, share: float, at: Progress) -> Job[None]:
        """Job: add ``k'`` of what has changed in the gap since the beginning, times `share`.

        It is what `correlated` lacks; in the picture it costs no transform of the whole.
        """
        if not self.filled:
            return
        for band, change in zip(self.bands, self.change, strict=True):
            yield from band.gathering(share * change, picture, at)


class Missing:
    """A plane whose pixels are not worth the same, filled in as far as they are missing.

    Majorize-minimize again: as far as a pixel is not worth its light, it holds what the sharp
    picture found so far would have recorded there, as does the gap.

    Parameters
    ----------
    extended : ndarray
        Periodic continuation of the blurred plane.
    transfer : ndarray
        Half spectrum of the PSF.
    weights : ndarray
        Of the plane, 0 to 1.
    """

    def __init__(self, extended: FloatArray, transfer: ComplexArray, weights: FloatArray) -> None:
        self.transfer, self.recorded = transfer, extended
        self.light, self.share = arrays.copy(extended), 1 + 0 * extended
        self.share[frame(weights.shape)] = 1 - weights

    def filling(self, sharp: FloatArray, at: Progress) -> Job[None]:
        """Job: fill in what the sharp picture would have recorded."""
        blurred = yield from convolving(sharp, self.transfer, at)
        yield at
        change = self.recorded + self.share * (blurred - self.recorded) - self.light
        change *= RELAXATION * (self.share > 0)
        self.light += change


class Weighted(Recorded):
    """The data of a plane whose pixels are not worth the same.

    Parameters
    ----------
    missing : Missing
    gain, correlated
        As for :class:`Recorded`.
    """

    def __init__(self, missing: Missing, gain: FloatArray, correlated: ComplexArray) -> None:
        super().__init__(missing.light, gain, correlated, [])
        self.missing = missing

    def filling(self, sharp: FloatArray, at: Progress) -> Job[None]:
        """Job: fill in what the sharp picture would have recorded, as far as it is missing."""
        yield from self.missing.filling(sharp, at)
        self.correlated = forward(self.missing.light)
        multiply_conjugate(self.correlated, self.missing.transfer)
        yield at


def recording(
    plane: FloatArray,
    psf: FloatArray,
    clipped: BoolArray | None,
    scale: float,
    at: Progress,
    weights: FloatArray | None = None,
) -> Job[tuple[FloatArray, Recorded]]:
    """Job: a plane over `scale`, highlights filled in and extended; and the data it gives."""
    filled = yield from filling(plane, psf, clipped, at)
    extended = yield from extending(filled.plane, psf, at)
    del filled
    extended /= scale
    yield at
    transfer = kept_otf(psf, extended.shape, extended)
    gain = power(transfer)
    yield at
    correlated = forward(extended)
    multiply_conjugate(correlated, transfer)
    yield at
    if weights is not None:
        missing = Missing(arrays.copy(extended), transfer, weights)
        return extended, Weighted(missing, gain, correlated)
    del transfer  # three planes are all that is kept
    sides = yield from banding(plane.shape, extended, psf, at)
    return extended, Recorded(extended, gain, correlated, sides)


class RecordedBlur(Protocol):
    """The blur `K` and the mask `M` of what was recorded, for iterations on ``K'MK x = K'My``.

    Parameters
    ----------
    gain : ndarray
        ``|K|^2``, of the half spectrum: the operator without the mask.
    """

    gain: FloatArray

    def correlate(self, spectrum: ComplexArray) -> None:
        """Multiply a spectrum by ``conj(K)``, in place."""

    def back_and_forth(self, scene: FloatArray, at: Progress) -> Job[FloatArray]:
        """Job: ``K'MK x``."""

    def reversing(self, light: FloatArray, at: Progress) -> Job[FloatArray]:
        """Job: ``K'M y`` for recorded light, whatever it holds in the gaps."""

    def choosing(self, scene: FloatArray, at: Progress) -> Job[FloatArray | None]:
        """Job: choose by the scene found so far what takes part; ``K'My`` if that changed."""


class BorderedBlur:
    """All of the frame was recorded: the mask costs transforms of bands around its border."""

    def __init__(self, transfer: ComplexArray, known: tuple[int, ...], sides: list[Band]) -> None:
        self.transfer, self.gain = transfer, power(transfer)
        self.known, self.bands = known, sides

    def correlate(self, spectrum: ComplexArray) -> None:
        """Multiply a spectrum by ``conj(K)``, in place."""
        multiply_conjugate(spectrum, self.transfer)

    def back_and_forth(self, scene: FloatArray, at: Progress) -> Job[FloatArray]:
        """Job: ``K'K x``, less the part that falls into the gap."""
        spectrum = forward(scene)
        yield at
        spectrum *= self.gain
        result = inverse(spectrum, scene.shape)
        yield at
        for band in self.bands:
            outside = yield from band.blurring(scene, at)
            yield from band.gathering(-outside, result, at)
        return result

    def reversing(self, light: FloatArray, at: Progress) -> Job[FloatArray]:
        """Job: ``K'M y``."""
        framed = 0 * light
        framed[frame(self.known)] = light[frame(self.known)]
        result = yield from correlating(framed, self.transfer, at)
        yield at
        return result

    def choosing(self, scene: FloatArray, at: Progress) -> Job[FloatArray | None]:  # noqa: ARG002
        """Job: nothing changes."""
        yield from ()
        return None


class MaskedBlur:
    """Some pixels are worth less, or are clipped: those take part where the scene falls short."""

    def __init__(
        self,
        transfer: ComplexArray,
        extended: FloatArray,
        plane: FloatArray,
        clipped: BoolArray | None,
        weights: FloatArray | None = None,
    ) -> None:
        self.transfer, self.gain = transfer, power(transfer)
        self.clipped, self.known = clipped, plane.shape
        self.light, self.mask = 0 * extended, 0 * extended
        self.light[frame(self.known)] = plane
        self.weights = 1 + 0 * plane if weights is None else weights
        self._leave_out(clipped)

    def correlate(self, spectrum: ComplexArray) -> None:
        """Multiply a spectrum by ``conj(K)``, in place."""
        multiply_conjugate(spectrum, self.transfer)

    def back_and_forth(self, scene: FloatArray, at: Progress) -> Job[FloatArray]:
        """Job: ``K'MK x``."""
        blurred = yield from convolving(scene, self.transfer, at)
        yield at
        blurred *= self.mask
        result = yield from correlating(blurred, self.transfer, at)
        yield at
        return result

    def reversing(self, light: FloatArray, at: Progress) -> Job[FloatArray]:  # noqa: ARG002
        """Job: ``K'M y`` for the plane as it was recorded."""
        result = yield from correlating(self.light * self.mask, self.transfer, at)
        yield at
        return result

    def choosing(self, scene: FloatArray, at: Progress) -> Job[FloatArray | None]:
        """Job: clipped pixels take part where the scene found falls short of them."""
        if self.clipped is None:
            return None
        blurred = yield from convolving(scene, self.transfer, at)
        yield at
        inside = frame(self.known)
        plane = self.light[inside]
        free = self.clipped & (blurred[inside] > plane)
        self._leave_out(free)
        return (yield from self.reversing(scene, at))

    def _leave_out(self, free: BoolArray | None) -> None:
        inside = frame(self.known)
        self.mask[inside] = self.weights
        if free is not None:
            self.mask[inside] = arrays.namespace(free).where(free, 0.0, self.weights)


def blurring(
    extended: FloatArray,
    plane: FloatArray,
    psf: FloatArray,
    clipped: BoolArray | None,
    at: Progress,
    weights: FloatArray | None = None,
) -> Job[RecordedBlur]:
    """Job: the blur and the mask of a plane that was extended for deconvolution."""
    transfer = kept_otf(psf, extended.shape, extended)
    yield at
    if clipped is not None or weights is not None:
        return MaskedBlur(transfer, extended, plane, clipped, weights)
    return BorderedBlur(transfer, plane.shape, (yield from banding(plane.shape, extended, psf, at)))
