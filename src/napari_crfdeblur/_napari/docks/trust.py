"""How far a response can be trusted, in the words and the color that the user sees."""

from dataclasses import replace

from ...estimate import ResponseStatus
from ...report import Report
from ...report.content import sentences
from ..session.state import Fitted, State
from ..session.step import Level

EARLIER = "estimated from earlier edges: estimate again"
FOLLOWS = "The response follows the edges; a full estimate comes after a pause."
NOTHING = "no response yet: estimate it from edges, load one, or use one that is known"
TRUSTED = {ResponseStatus.GOOD, ResponseStatus.GIVEN}


def trust_in_state(state: State) -> tuple[str, Level]:
    """What to tell of the response that is shown, and how it is meant."""
    if state.live is not None:
        text, level = trust_in(state.live, earlier=False)
        return f"{FOLLOWS}\n{text}", level
    edges = state.fitted.edges if state.fitted else None
    return trust_in(state.fitted, earlier=edges is not None and edges is not state.edges)


def trust_in(fitted: Fitted | None, earlier: bool) -> tuple[str, Level]:
    """What to tell of a response, and how it is meant.

    Parameters
    ----------
    fitted : Fitted or None
        The response, if there is one.
    earlier : bool
        Whether it was estimated from edges that have changed since.
    """
    if fitted is None:
        return NOTHING, Level.INFO
    statuses = {estimate.status for estimate in fitted.estimates}
    bare = [replace(estimate, findings=()) for estimate in fitted.estimates]
    said = sentences(Report("", responses=bare))
    text = " ".join(f"{name}: {sentence}" for name, sentence in said.items())
    text = "\n".join([text, *fitted.doubts])
    if ResponseStatus.NOT_CONVERGED in statuses:
        return text, Level.ERROR
    if earlier:
        return f"Response {EARLIER}.", Level.DOUBT
    return text, Level.INFO if statuses <= TRUSTED else Level.DOUBT
