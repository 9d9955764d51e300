"""The response once more, in the light of the PSF; kept if it explains the photo better."""

from dataclasses import replace

import numpy as np

from ..estimate import MaximumLikelihood, estimating_responses
from ..progress import Job, Progress
from ..psf.misfit import misfit
from .intermediates import PLANE, Intermediates, made
from .options import DeblurOptions
from .path import find_psf, undo_response

# Of what was unexplained, the share that may be left. Of 17 even-numbered photos of known response,
# 5 left .94 or less, all of which gained; those that would have lost left .98 or more.
MOST_LEFT = 0.96


def find_psf_in_turns(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:
    """Stage, in the place of :func:`~.path.find_psf`: the PSF, and the response with it.

    The PSF is found in the light of the response; the response is found again from the same
    profiles with that PSF, which tells the power that edges alone leave open. It is kept if it
    leaves clearly less of the photo unexplained at the frequencies that the PSF blocks
    (:func:`~napari_crfdeblur.psf.misfit.misfit`): a response that is wrong fills them.

    Use it as ``walking(have, options, replaced={Stage.PSF: find_psf_in_turns})``. It changes
    nothing unless the method for the response is :class:`~.estimate.MaximumLikelihood` without
    a PSF, and there are profiles.
    """
    have = yield from find_psf(have, options)
    method = options.response
    if not isinstance(method, MaximumLikelihood) or method.psf is not None:
        return have
    if not have.groups or have.axes != PLANE:
        return have
    yield Progress("response in the light of the PSF", 0, 1)
    knowing = replace(method, psf=made(have.psf, "a PSF").psf)
    renewed = yield from estimating_responses(made(have.groups, "profiles"), knowing)
    other = yield from undo_response(replace(have, response=renewed, linear=None), options)
    return other if unexplained(other) < MOST_LEFT * unexplained(have) else have


def unexplained(have: Intermediates) -> float:
    """What the linear picture shows at the frequencies that its PSF blocks, as a share.

    Of four standard deviations of the picture; 0 if it is too small to tell.
    """
    linear, psf = made(have.linear, "linear light"), made(have.psf, "a PSF").psf
    clipped = have.clipped
    if linear.ndim == 3:
        linear, clipped = linear.mean(axis=2), np.asarray(clipped.any(axis=2))
    left = misfit([linear], psf, [clipped], least_blocked=0.0) or 0.0
    return float(left / max(4 * linear.std(), np.finfo(np.float32).tiny))
