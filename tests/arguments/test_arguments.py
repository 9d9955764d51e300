"""Every public call gives a finite result, or one sentence that says what it expected."""

import inspect
import warnings
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from math import inf
from typing import Any

import numpy as np
import pytest
from right_calls import CALLS
from small_things import CAMERA, CASE, EDGE, GROUPS, KERNEL, PHOTO, PLANE, SHAKEN
from wrong_values import WRONG

import napari_crfdeblur as package
from napari_crfdeblur import (
    deconvolution,
    edges,
    estimate,
    profiles,
    psf,
    quality,
    response,
    simulate,
)
from napari_crfdeblur.deconvolution import (
    Deconvolver,
    PlaneStatistics,
    Wiener,
    deconvolve,
    deconvolve_varying,
)
from napari_crfdeblur.edges import Edge, Line, Rectangle
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import MeanProfile, PolynomialFit, estimate_response
from napari_crfdeblur.profiles import Alignment, Grouping, sample_profiles
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import Poses, PsfField
from napari_crfdeblur.response import ResponseCurve, linearize
from napari_crfdeblur.simulate import Camera, CameraMotion, ProfileCase, Scene, random_profiles

SEED = 7
LONGEST = 300  # characters of a message
FEWER = {simulate.street: 4}  # which takes a second
DRAWN = 24  # of the wrong values, for each argument: some 6000 calls in all
STAGES = (package, response, edges, profiles, psf, estimate, deconvolution, simulate)
# Whole paths, which the tests of the pipeline try, names of types, and results.
ELSEWHERE = {
    "DeblurOptions",
    "Deblurred",
    "Evidence",
    "deblur",
    "estimate_psf",
    "estimate_psf_field",
    "estimate_psf_from_profiles",
    "estimate_responses",
    "PerChannel",
    "Point",
    "Response",
    "Responses",
    "Simulated",
}
# Those of `psf.base`, `psf.given`, `estimate.base` and `estimate.given` do not check all yet.
LENIENT = {
    "GivenPsf",
    "GivenResponse",
    "PsfEstimate",
    "ResponseEstimate",
    "as_psf",
    "centered",
    "cleared",
    "estimate_response",
}


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
}


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
    if is_dataclass(value):
        own = [f.name for f in fields(value) if f.name != "photons"]
        return all(is_finite(getattr(value, name)) for name in own)
    return not isinstance(value, complex)


def check_outcome(call: Callable[..., Any], given: dict[str, Any], what: str) -> None:
    """Call: the result is finite or refused in words, the arguments are as before."""
    before = {name: value.tobytes() for name, value in given.items() if is_plain(value)}
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
    after = {name: value.tobytes() for name, value in given.items() if is_plain(value)}
    assert after == before, what


def is_plain(value: Any) -> bool:
    return isinstance(value, np.ndarray) and not value.dtype.hasobject


def drawn(call: Callable[..., Any]) -> Iterator[tuple[str, Any]]:
    """Wrong values for each argument of a call."""
    rng = np.random.default_rng([SEED, list(CALLS).index(call)])
    for argument in CALLS[call]:
        for number in rng.permutation(len(WRONG))[: FEWER.get(call, DRAWN)]:
            yield argument, WRONG[number]


def each_call() -> list[Any]:
    lenient = pytest.mark.xfail(reason="does not check all of its arguments", strict=False)
    return [
        pytest.param(call, marks=lenient if call.__name__ in LENIENT else (), id=call.__name__)
        for call in CALLS
    ]


@pytest.mark.parametrize("call", each_call())
def test_a_wrong_argument_is_refused_in_words_or_does_no_harm(call):
    for argument, wrong in drawn(call):
        what = f"{call.__name__}({argument}={wrong!r:.80})"
        check_outcome(call, CALLS[call] | {argument: wrong}, what)


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.__name__)
def test_a_right_call_gives_a_finite_result(call):
    assert is_finite(call(**CALLS[call]))


def test_every_public_callable_is_tried():
    public = {name: getattr(stage, name) for stage in STAGES for name in stage.__all__}
    public |= {name: value for name, value in vars(quality).items() if is_own(value, name)}
    tried = {call.__name__ for call in CALLS} | ELSEWHERE
    forgotten = {name for name, value in public.items() if is_to_be_tried(value)} - tried
    assert not forgotten, f"add a right call of {sorted(forgotten)} to right_calls.py"


def is_own(value: Any, name: str) -> bool:
    """Whether it is a public function of `quality`, which is a module without a list of them."""
    own = getattr(value, "__module__", None) == quality.__name__
    return own and not name.startswith(("_", "check"))


def is_to_be_tried(value: Any) -> bool:
    """Functions and concrete classes; jobs are tried by their verbs."""
    if inspect.isclass(value):
        return not (inspect.isabstract(value) or issubclass(value, (Enum, Exception)))
    return callable(value) and not inspect.isgeneratorfunction(value)


def test_enough_calls_are_made():
    assert sum(len(arguments) for arguments in CALLS.values()) * DRAWN > 1500
