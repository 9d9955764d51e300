"""Every public call gives a finite result, or one sentence that says what it expected."""

import inspect
from collections.abc import Callable, Iterator
from enum import Enum
from typing import Any, get_origin

import numpy as np
import pytest
from outcomes import check_outcome, is_finite
from right_calls import CALLS
from wrong_values import WRONG

import napari_crfdeblur as package
from napari_crfdeblur import (
    deconvolution,
    edges,
    estimate,
    pipeline,
    profiles,
    psf,
    quality,
    response,
    simulate,
)

SEED = 7
DRAWN = 20  # of the wrong values, for each argument: some 6000 calls in all
FEWER = {simulate.street: 4, psf.estimate_psf_field: 3, psf.estimate_psf: 8}  # which take long
STAGES = (package, response, edges, profiles, psf, estimate, deconvolution, simulate, pipeline)
# What verbs give back, of parts that were checked when they were made.
RESULTS = (
    deconvolution.Guarded,
    deconvolution.Judged,
    deconvolution.Trust,
    pipeline.Deblurred,
    pipeline.Repeated,
    pipeline.Restored,
    simulate.Simulated,
)


def drawn(call: Callable[..., Any]) -> Iterator[tuple[str, Any]]:
    """Wrong values for each argument of a call."""
    rng = np.random.default_rng([SEED, list(CALLS).index(call)])
    for argument in CALLS[call]:
        for number in rng.permutation(len(WRONG))[: FEWER.get(call, DRAWN)]:
            yield argument, WRONG[number]


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.__name__)
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
    tried = {call.__name__ for call in CALLS}
    forgotten = {name for name, value in public.items() if is_to_be_tried(value)} - tried
    assert not forgotten, f"add a right call of {sorted(forgotten)} to right_calls.py"


def is_own(value: Any, name: str) -> bool:
    """Whether it is a public function of `quality`, which is a module without a list of them."""
    own = getattr(value, "__module__", None) == quality.__name__
    return own and not name.startswith(("_", "check"))


def is_to_be_tried(value: Any) -> bool:
    """Functions and concrete classes; jobs are tried by their verbs, results come of them."""
    if get_origin(value) is not None or value in RESULTS:
        return False
    if inspect.isclass(value):
        return not (inspect.isabstract(value) or issubclass(value, (Enum, Exception)))
    return callable(value) and not inspect.isgeneratorfunction(value)


def test_enough_calls_are_made():
    assert sum(len(arguments) for arguments in CALLS.values()) * DRAWN > 1500
