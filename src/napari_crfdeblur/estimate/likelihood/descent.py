"""Down to the most probable response: Levenberg and Marquardt's method."""

from dataclasses import dataclass

import numpy as np

from .model import State
from .problem import Problem

MOST_STEPS = 40
MOST_TRIALS = 8  # of a damping for one step; each is ten times the last
FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-9
LEAST_GAIN = 1e-3  # of the objective, in which a standard deviation of the prior counts 1/2


@dataclass(frozen=True, slots=True, eq=False)
class Descent:
    """End of a search: the state, the value of the objective, whether it has settled."""

    state: State
    value: float
    settled: bool


def descend(problem: Problem, state: State, steps: int = MOST_STEPS) -> Descent:
    """Follow the objective down from a state until it hardly changes."""
    value, damping = problem.value(state), FIRST_DAMPING
    for _ in range(steps):
        normal = problem.normal(state)
        for tried in damping * 10.0 ** np.arange(MOST_TRIALS):
            proposed = normal.step(state, tried)
            reached = problem.value(proposed)
            if reached < value:
                break
        else:
            return Descent(state, value, settled=True)
        damping = max(tried / 10, LEAST_DAMPING)
        state, gain, value = proposed, value - reached, reached
        if gain < LEAST_GAIN:
            return Descent(state, value, settled=True)
    return Descent(state, value, settled=False)
