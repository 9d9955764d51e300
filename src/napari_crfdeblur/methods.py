"""The methods that can be chosen, told once: command, window, preferences and documents use it.

It names them without loading them, so that the command can tell its options at once.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any


@dataclass(frozen=True, slots=True)
class Method:
    """A method that can be chosen.

    Parameters
    ----------
    word : str
        In the command and in napari's settings.
    label : str
        In the window.
    stage : str
        The module that exports its class.
    kind : str
        Its class.
    fields : tuple of (str, str)
        Fields that differ from the defaults: the name, and the name of a member of the choice
        that it is.
    """

    word: str
    label: str
    stage: str
    kind: str
    fields: tuple[tuple[str, str], ...] = ()

    def make(self, **values: Any) -> Any:
        """The method, with these values of its fields and else the defaults."""
        home = import_module(f".{self.stage}", __package__)
        own = {}
        for name, choice in self.fields:
            kind, _, member = choice.partition(".")
            own[name] = getattr(home, kind)[member]
        return getattr(home, self.kind)(**own, **values)


RESPONSES = (
    Method("likelihood", "maximum likelihood", "estimate", "MaximumLikelihood"),
    Method("rank", "rank minimization", "estimate", "RankMinimization"),
    Method(
        "rank-all",
        "rank minimization, all singular values",
        "estimate",
        "RankMinimization",
        (("tail", "Tail.ALL"),),
    ),
    Method("mean", "mean profile", "estimate", "MeanProfile"),
)
"""Ways to find the response from the photo alone."""

PSFS = (
    Method("portfolio", "several, the most plausible", "psf", "Portfolio"),
    Method("variational", "variational", "psf", "Variational"),
    Method("xu-jia", "Xu & Jia", "psf", "XuJia"),
    Method("l0-gradient", "fewest steps (L0)", "psf", "L0Gradient"),
    Method("minimal-pixels", "darkest pixels", "psf", "MinimalPixels"),
    Method("fergus", "Fergus et al.", "psf", "Fergus"),
    Method("shan", "Shan et al.", "psf", "Shan"),
    Method("edges", "straight edges (Radon)", "psf", "RadonFit"),
    Method("radon-map", "picture and edges (Radon)", "psf", "RadonMap"),
    Method("streaks", "light streaks", "psf", "Streaks"),
)
"""Ways to find the PSF."""

DECONVOLUTIONS = (
    Method("local-shrinkage", "local shrinkage", "deconvolution", "LocalShrinkage"),
    Method("hyper-laplacian", "hyper-Laplacian", "deconvolution", "HyperLaplacian"),
    Method("irls", "sparse (IRLS)", "deconvolution", "SparseIrls"),
    Method("total-variation", "total variation", "deconvolution", "TotalVariation"),
    Method("wiener", "Wiener", "deconvolution", "Wiener"),
    Method("richardson-lucy", "Richardson-Lucy", "deconvolution", "RichardsonLucy"),
)
"""Ways to undo the blur, the default first."""

MOST_STRENGTH = 2.0
"""How much of them there can be: 0 is none, 1 what each finds right."""


def words(choices: tuple[Method, ...]) -> tuple[str, ...]:
    """What they are called in the command."""
    return tuple(choice.word for choice in choices)


def named(choices: tuple[Method, ...], word: str) -> Method:
    """The one of this word.

    Raises
    ------
    ValueError
        There is none.
    """
    found = [choice for choice in choices if choice.word == word]
    if not found:
        raise ValueError(f"expected one of {', '.join(words(choices))}, got {word!r:.40}")
    return found[0]
