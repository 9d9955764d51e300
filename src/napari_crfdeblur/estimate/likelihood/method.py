"""Maximum likelihood with a prior: the default way to estimate a response."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ... import arguments
from ..._typing import FloatArray
from ...profiles.base import ProfileGroup
from ...progress import Job
from ...psf.base import as_planar_psf
from ...response import Cameras, ResponsePrior
from ..band import covered_range
from ..base import ResponseEstimate, ResponseFit, Responses
from ..identifiability import contrasted
from .agreement import agreeing, by_photo
from .evidence import edge_groups
from .live import LEAST_CONTRAST, LiveFit
from .noise_model import NoiseModel
from .posterior import ResponsePosterior
from .problem import Shift
from .registration import misregistration
from .search import Solution, maximizing
from .verdict import assumed, judged


@dataclass(frozen=True, slots=True, eq=False)
class MaximumLikelihood(ResponseFit):
    """The most probable response, given the profiles and what is known of cameras.

    Profile `j` of a group is ``f(l_j + w_j s(m + a_j))`` with an edge spread `s` common to the
    group, rising or falling, and a sub-pixel shift `a_j` that the channels of an edge nearly share
    (Kim et al. 2012, 4.1, for the model). Minimized are the squared residuals of the recorded
    intensity over all of these and the coefficients of the response `f`, whose prior is normal.
    Whole edges that fit badly lose their weight, and the evidence counts for as much as the
    scatter of the edges says. Without any profile of good contrast, the prior is handed out.

    Parameters
    ----------
    prior : Cameras or ResponsePrior
        What is assumed of the camera: a kind, the curves near a known one
        (:func:`~napari_crfdeblur.response.around`), or the posterior of an earlier estimate.
    psf : ndarray, shape (H, W), optional
        Point spread function, if it is known: it gives the shape of all profiles.
    noise : NoiseModel
        How much a sample counts.
    shift : float
        Standard deviation of the place of an edge, pixels.
    channel_shift : float
        Standard deviation of the place of one channel of an edge besides.
    """

    prior: Cameras | ResponsePrior = Cameras.DIGITAL
    psf: FloatArray | None = None
    noise: NoiseModel = field(default_factory=NoiseModel)
    shift: float = 0.3
    channel_shift: float = 0.1

    def __post_init__(self) -> None:
        kinds = Cameras, ResponsePrior
        arguments.instance(self.prior, kinds, "a kind of camera or a prior")
        arguments.instance(self.noise, NoiseModel, "a NoiseModel")
        for shift in (self.shift, self.channel_shift):
            arguments.number(shift, "a positive shift in pixels", least=1e-6, most=1e6)
        if self.psf is not None:
            psf = as_planar_psf(self.psf)
            psf.setflags(write=False)
            object.__setattr__(self, "psf", psf)

    def run(self, groups: Sequence[ProfileGroup]) -> Job[ResponseEstimate]:
        """Long job: see :class:`ResponseFit`."""
        return (yield from self._fitting(groups)).estimate

    def fitting(self, groups: Sequence[ProfileGroup]) -> Job[Responses]:
        """Long job: the estimate of :meth:`run`, ready to follow its profiles as they change."""
        fit = yield from self._fitting(groups)
        return Responses((fit.estimate,), (fit,))

    def _fitting(self, groups: Sequence[ProfileGroup]) -> Job[LiveFit]:
        usable = contrasted(groups, LEAST_CONTRAST)
        seen = isinstance(self.prior, ResponsePrior)
        prior = self.prior if isinstance(self.prior, ResponsePrior) else self.prior.prior
        if not usable:
            return LiveFit(assumed(prior), None, self.noise, self.psf, seen)
        found = yield from self._search(prior, usable)
        photos = by_photo(usable)
        known, covered = [], []
        if seen or len(photos) > 1:
            for own in photos:
                # Alone, and with a prior that leaves it free to disagree.
                alone = yield from self._search(Cameras.DIGITAL.prior if seen else prior, own)
                known.append(ResponsePosterior.of(alone))
                covered.append(covered_range(own))
        if seen:
            known.append(ResponsePosterior.before(prior))
            covered.append((0.0, 1.0))
        estimate = judged(
            found,
            usable,
            seen=seen,
            agree=agreeing(known, covered),
            displaced=float(np.hypot(*misregistration(found).T).max()),
        )
        return LiveFit(estimate, found, self.noise, self.psf, seen)

    def _search(self, prior: ResponsePrior, groups: Sequence[ProfileGroup]) -> Job[Solution]:
        shift = Shift(self.shift, self.channel_shift)
        return (yield from maximizing(prior, edge_groups(groups), self.noise, shift, self.psf))
