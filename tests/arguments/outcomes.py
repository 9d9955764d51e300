"""What may come of a call: a finite result, or one sentence that says what it expected."""

import warnings
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from math import inf
from typing import Any

import numpy as np
import pytest
from small_things import CAMERA, CASE, EDGE, GROUPS, KERNEL, PHOTO, PLANE, QUICK, SHAKEN

from napari_crfdeblur import edges, quality, simulate
from napari_crfdeblur.deconvolution import (
    Deconvolver,
    PlaneStatistics,
    Wiener,
    deconvolve,
    deconvolve_varying,
)
from napari_crfdeblur.edges import Edge, Line, Rectangle
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import (
    MeanProfile,
    PerChannel,
    PolynomialFit,
    ResponseEstimate,
    Responses,
    estimate_response,
    estimate_responses,
    given_responses,
)
from napari_crfdeblur.pipeline import (
    DeblurOptions,
    Intermediates,
    PhotoStack,
    Record,
    deblur,
    restoring_stack,
    walking,
)
from napari_crfdeblur.profiles import Alignment, Grouping, sample_profiles
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import Evidence, GivenPsf, Poses, PsfEstimate, PsfField, estimate_psf
from napari_crfdeblur.response import Gamma, ResponseCurve, linearize
from napari_crfdeblur.simulate import Camera, CameraMotion, ProfileCase, Scene, random_profiles

LONGEST = 300  # characters of a message


def simulated(psf: Any, camera: Camera) -> Any:
    return simulate.simulate(Scene(PLANE), psf, camera).photo


# What is done with an object that was made: it, too, gives a finite result, or says why not.
USES: dict[type, Callable[[Any], Any]] = {
    Deconvolver: lambda method: deconvolve(PLANE, KERNEL, method),
    ResponseCurve: lambda curve: linearize(PLANE, curve),
    Grouping: lambda rule: sample_profiles(PHOTO, [EDGE], grouping=rule),
    Alignment: lambda way: sample_profiles(PHOTO, [EDGE], alignment=way),
    PolynomialFit: lambda fit: estimate_response(GROUPS, MeanProfile(fit)),
    Camera: lambda camera: simulated(KERNEL, camera),
    CameraMotion: lambda motion: simulated(motion, CAMERA),
    ProfileCase: lambda case: random_profiles(CAMERA, replace(case, levels=CASE.levels), seed=1),
    PlaneStatistics: lambda found: drain(Wiener().run(PLANE, SHAKEN, statistics=found)),
    Poses: lambda poses: poses.psf_at((2.0, -3.0)),
    PsfField: lambda psfs: deconvolve_varying(PLANE, psfs, Wiener()),
    Edge: lambda edge: sample_profiles(PHOTO, [edge]),
    Line: lambda line: edges.refine_edges(PHOTO, [line], blur_extent=5.0),
    Rectangle: lambda shape: edges.refine_edges(PHOTO, [shape], blur_extent=5.0),
    Evidence: lambda evidence: estimate_psf(evidence, GivenPsf(KERNEL)),
    GivenPsf: lambda method: estimate_psf(PLANE, method),
    PsfEstimate: lambda found: deconvolve(PLANE, found.psf, Wiener()),
    ResponseEstimate: lambda found: linearize(PLANE, found.curve),
    Responses: lambda found: linearize(PLANE, found.curve),
    PerChannel: lambda method: estimate_responses(GROUPS, method),
    DeblurOptions: lambda options: deblur(PHOTO, options),
    Intermediates: lambda have: drain(walking(have, QUICK)),
    PhotoStack: lambda stack: drain(
        restoring_stack(stack, stack.whole, given_responses(Gamma(2.0)), SHAKEN, QUICK)
    ),
    Record: lambda record: record.check_fits(PhotoStack(PHOTO, rgb=False)),
}
# Which hold pixels as they came; what is made of them is checked.
AS_THEY_CAME = (Evidence, Intermediates, PhotoStack)


def is_finite(value: Any) -> bool:
    """Whether all numbers in a result are, but for photons without limit and a perfect PSNR."""
    if hasattr(value, "compute"):
        value = value.compute(scheduler="synchronous")
    if isinstance(value, (np.ndarray, float, np.floating)):
        return bool(np.isfinite(value).all())
    if isinstance(value, (tuple, list)):
        return all(map(is_finite, value))
    if isinstance(value, dict):
        return all(map(is_finite, value.values()))
    if isinstance(value, AS_THEY_CAME):
        return True
    if is_dataclass(value):
        own = [f.name for f in fields(value) if f.name != "photons"]
        return all(is_finite(getattr(value, name)) for name in own)
    return not isinstance(value, complex)


def check_outcome(call: Callable[..., Any], given: dict[str, Any], what: str) -> None:
    """Call: the result is finite or refused in words, the arguments are as before."""
    before = bytes_of(given)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            result = call(**given)
            assert is_finite(result) or (call is quality.psnr and result == inf), what
            for kind, use in USES.items():
                if isinstance(result, kind):
                    assert is_finite(use(result)), what
    except (ValueError, CrfDeblurError) as refusal:
        said = str(refusal)
        in_words = "expected" in said if isinstance(refusal, ValueError) else bool(said)
        if not in_words or len(said) > LONGEST:
            pytest.fail(f"{what}: {said}")
    assert bytes_of(given) == before, what


def bytes_of(given: dict[str, Any]) -> dict[str, bytes]:
    plain = {n: a for n, a in given.items() if isinstance(a, np.ndarray) and not a.dtype.hasobject}
    return {name: array.tobytes() for name, array in plain.items()}
