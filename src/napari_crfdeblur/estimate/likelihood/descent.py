"""Down to the most probable response: Levenberg and Marquardt's method."""

from dataclasses import dataclass

from .model import ModelState
from .problem import NormalEquations, Problem

MOST_STEPS = 40
MOST_TRIALS = 8  # for one step: each ten times more damped, and half as long
FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-9
LEAST_GAIN = 1e-3  # of the objective, in which a standard deviation of the prior counts 1/2


@dataclass(frozen=True, slots=True, eq=False)
class Descent:
    """End of a search.

    Parameters
    ----------
    state : ModelState
        Where it ended.
    value : float
        The objective there.
    normal : NormalEquations
        Normal equations of the last step, which hardly moved if the search has settled.
    settled : bool
        Whether it has.
    """

    state: ModelState
    value: float
    normal: NormalEquations
    settled: bool


def descend(
    problem: Problem,
    state: ModelState,
    steps: int = MOST_STEPS,
    least_gain: float = LEAST_GAIN,
    rough: float = 0.0,
) -> Descent:
    """Follow the objective down from a state until a step gains less than asked for.

    Asked for is `least_gain`, and a share `rough` of the objective.
    """
    value, damping = problem.value(state), FIRST_DAMPING
    for _ in range(steps):
        normal = problem.normal(state)
        for trial in range(MOST_TRIALS):
            tried = damping * 10**trial
            change = normal.change(tried, 0.5**trial)
            proposed, reached = problem.lowest(normal, state, change)
            if reached < value:
                break
        else:
            return Descent(state, value, normal, settled=True)
        damping = max(tried / 10, LEAST_DAMPING)
        state, gain, value = proposed, value - reached, reached
        if gain < max(least_gain, rough * value):
            return Descent(state, value, normal, settled=True)
    return Descent(state, value, normal, settled=False)
