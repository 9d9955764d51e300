"""Photos and options drawn at random, and the ways by which a photo is deblurred with them."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from napari.components import ViewerModel
from scipy.ndimage import gaussian_filter

from napari_crfdeblur import DeblurOptions, Session, deblur, find_edges
from napari_crfdeblur.deconvolution import (
    HyperLaplacian,
    LocalShrinkage,
    RichardsonLucy,
    SparseIrls,
    TotalVariation,
    Wiener,
)
from napari_crfdeblur.edges import Line
from napari_crfdeblur.estimate import (
    GivenResponse,
    MaximumLikelihood,
    PerChannel,
    PolynomialFit,
    RankMinimization,
)
from napari_crfdeblur.pipeline import PhotoStack, suited_estimator
from napari_crfdeblur.psf import (
    GivenPsf,
    RadonFit,
    RadonMap,
    Variational,
    XuJia,
    camera_shake,
    line,
)
from napari_crfdeblur.response import SRGB, Gamma, Identity
from napari_crfdeblur.simulate import Camera, simulate, slanted_edges

METHODS = (
    LocalShrinkage(stages=2),
    HyperLaplacian(stages=2),
    SparseIrls(iterations=1, steps=1),
    TotalVariation(iterations=2),
    RichardsonLucy(iterations=2),
    LocalShrinkage(),
    RichardsonLucy(),
    Wiener(),
    Wiener(),
    Wiener(weight=0.01),
    Wiener(model_error=0.02),
)
CURVES = (SRGB(), Identity(), Gamma(1.5), Gamma(2.2))
KERNELS = (line(3, 0.3), line(4, 1.2), camera_shake(5, 3), np.full((1, 3), 1 / 3))
QUICK = RankMinimization(polynomial=PolynomialFit(resamples=0))
KINDS = (np.uint8, np.uint16, np.float32)
RARE = 40  # one of so many sets looks for the response or the PSF, which takes longer


@dataclass(frozen=True, slots=True, eq=False)
class OptionSet:
    """A photo or a stack, and how it is deblurred.

    Parameters
    ----------
    stack : PhotoStack
    options : DeblurOptions
    plane : tuple of int
        Slice of a stack in which response and PSF are found.
    region : tuple of (int, int), optional
        What is restored; all of it by default.
    """

    stack: PhotoStack
    options: DeblurOptions
    plane: tuple[int, ...] = ()
    region: tuple[tuple[int, int], ...] | None = None

    @property
    def whole(self) -> bool:
        """Whether all of it is restored."""
        return self.region is None


def option_sets(seed: int, count: int) -> Iterator[OptionSet]:
    """Sets of options, one like no other; most of them give response and PSF."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        if number % RARE == 0:
            yield _with_known_psf(rng, number // RARE)
        elif number % RARE == 20:
            yield _with_known_response(rng, number // RARE)
        else:
            yield _all_given(rng)


def in_a_session(each: OptionSet) -> Session:
    """A session on the photo, which shows the slice of the set."""
    viewer = ViewerModel()
    photo = viewer.add_image(each.stack.data, rgb=each.stack.rgb, name=each.stack.name)
    for axis, index in enumerate(each.plane):
        viewer.dims.set_current_step(axis, index)
    return Session(viewer, photo, white=each.stack.white)


def by_the_library(each: OptionSet) -> np.ndarray:
    """Pixels of the restored region, by `deblur` alone: slice by slice with what one has told."""
    stack, spans = each.stack, each.region
    region = stack.whole if spans is None else tuple(slice(*span) for span in spans)
    lead = len(stack.shape) - 2
    plane = (*(slice(i, i + 1) for i in each.plane), *stack.whole[-2:])
    found = deblur(stack.photo(plane), each.options)
    if each.whole and not lead:
        return stack.recorded(found.photo)
    curves = [own.curve for own in found.responses]
    known = DeblurOptions(
        response=PerChannel.given(curves),
        psf=GivenPsf(found.psf.psf, found.field),
        method=each.options.method,
    )
    if not lead:
        return stack.recorded(deblur(stack.photo(region), known).photo)
    slices = [
        deblur(stack.photo((slice(i, i + 1), *region[1:])), known).photo
        for i in range(region[0].start, region[0].stop)
    ]
    return stack.recorded(np.stack(slices))


def by_verbs(session: Session, each: OptionSet, *, in_one: bool) -> np.ndarray:
    """Pixels of the restored region, by one verb after the other."""
    options, extent = each.options, each.options.blur_extent
    response, psf = options.response, options.psf
    if response.needs_profiles or (psf is not None and psf.needs_edges):
        if options.edges is None:
            session.detect_edges(extent, plane=each.plane)
        else:
            session.set_edges(options.edges, extent, plane=each.plane)
    if response.needs_profiles:
        session.estimate_response(response)
    else:
        session.set_response(curve_of(response))
    if isinstance(psf, GivenPsf):
        session.set_psf(psf.psf, field=psf.field)
    else:
        sides = each.stack.shape[-2:]
        where = [*((i, i + 1) for i in each.plane), *((0, side) for side in sides)]
        method = psf or suited_estimator(np.empty(sides), extent)
        session.estimate_psf(method, region=where, regions=options.regions)
    if in_one:
        return np.asarray(session.restore(options.method, region=each.region).data)
    session.linearize(region=each.region)
    session.deconvolve(options.method)
    return np.asarray(session.reapply().data)


def curve_of(response):
    """What `Session.set_response` takes of a response that is given."""
    if isinstance(response, PerChannel):
        return tuple(fit.curve for fit in response.fits)
    return response.curve


def _pick(rng, members):
    return members[int(rng.integers(len(members)))]


def _all_given(rng) -> OptionSet:
    """A response and a PSF that are known, on a photo or a stack of any kind."""
    sides = (int(rng.integers(24, 49)), int(rng.integers(24, 61)))
    colors = _pick(rng, (0, 0, 3, 4))
    depth = _pick(rng, (0, 0, 0, 2, 3))
    light = rng.random((*([depth] if depth else []), *sides, *([colors] if colors else [])))
    blurred = gaussian_filter(light, (*([0] if depth else []), 1, 1, *([0] if colors else [])))
    kind = np.dtype(_pick(rng, KINDS))
    white = _pick(rng, (None, None, 200.0 if kind == np.uint8 else 3000.0))
    full = (np.iinfo(kind).max if kind.kind == "u" else 1) if white is None else white
    stack = PhotoStack((blurred * full).astype(kind), bool(colors), white, "photo")
    curve, psf = _pick(rng, CURVES), GivenPsf(_pick(rng, KERNELS))
    response = GivenResponse(curve)
    if colors and rng.random() < 0.3:
        response = PerChannel.given([_pick(rng, CURVES) for _ in range(3)])
    options = DeblurOptions(response=response, psf=psf, method=_pick(rng, METHODS))
    if rng.random() < 0.2:
        options = replace(options, blur_extent=float(rng.uniform(3, 12)))
    if rng.random() < 0.2:
        options = replace(options, edges=(Line((3.0, 3.0), (20.0, 15.0)),))
    plane = (int(rng.integers(depth)),) if depth else ()
    region = None
    if rng.random() < 0.3:
        spans = [
            (int(rng.integers(side // 3)), side - int(rng.integers(side // 3))) for side in sides
        ]
        region = (*([(int(rng.integers(depth)), depth)] if depth else []), *spans)
    return OptionSet(stack, options, plane, region)


def _with_known_psf(rng, number: int) -> OptionSet:
    """A response that is estimated from edges: found, drawn, measured, of each channel."""
    psf = KERNELS[0]
    colors = number == 3
    fit = MaximumLikelihood() if number == 2 else QUICK
    size = (52, 104) if number in (2, 3) else (96, 120)  # the likelihood asks for fewer edges
    pixels = _with_edges(psf, 3 if colors else 1, number % 3, size)
    stack = PhotoStack(pixels, colors, name="photo")
    options = DeblurOptions(response=fit, psf=GivenPsf(psf), method=Wiener())
    if number % 3 == 1:
        found = find_edges(stack.data, blur_extent=8.0)
        drawn = tuple(edge if n % 2 else Line(edge.start, edge.end) for n, edge in enumerate(found))
        options = replace(options, edges=drawn, blur_extent=8.0)
    if number % 3 == 2:
        options = replace(options, blur_extent=float(rng.uniform(6, 10)))
    if number == 3:
        options = replace(options, response=PerChannel.alike(MaximumLikelihood()))
    return OptionSet(stack, options)


def _with_known_response(rng, number: int) -> OptionSet:
    """A PSF that is found in the picture or from its edges, of the whole or of parts."""
    colors = number == 3
    pixels = _with_edges(_pick(rng, KERNELS), 3 if colors else 1, number, (52, 104))
    ways = (XuJia(size=5), RadonFit(size=5), Variational(size=3), None, RadonMap(size=5))
    options = DeblurOptions(
        response=GivenResponse(_pick(rng, CURVES)),
        psf=ways[number % len(ways)],
        method=Wiener(),
        blur_extent=4.0 if number in (1, 3) else None,
        regions=(1, 2) if number == 4 else None,
    )
    return OptionSet(PhotoStack(pixels, colors, name="photo"), options)


def _with_edges(psf: np.ndarray, channels: int, seed: int, sides: tuple[int, int]) -> np.ndarray:
    """A blurred photo with edges of which a response can be told."""
    rows, columns = (side + reach - 1 for side, reach in zip(sides, psf.shape, strict=True))
    colors = {"channels": channels} if channels > 1 else {}
    scene = slanted_edges((rows, columns), seed=3, pitch=48, **colors)
    return simulate(scene, psf, Camera(Gamma(1.8), noise=0.002), seed=seed).photo
