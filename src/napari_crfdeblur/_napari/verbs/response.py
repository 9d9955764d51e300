"""Verbs of a session that find the response of the camera."""

from collections.abc import Sequence
from pathlib import Path

from napari.layers import Image as ImageLayer

from ...estimate import ResponseFit
from ...io import read_responses
from ...response import Response
from .. import steps
from ..state import Fitted
from ..workspace import Workspace


class ResponseVerbs(Workspace):
    """Verbs of a session that find the response of the camera."""

    def estimate_response(
        self,
        method: ResponseFit | None = None,
        *,
        per_channel: bool = False,
        others: Sequence[ImageLayer | Path | str] = (),
    ) -> Fitted:
        """Estimate the camera response from the edges.

        Parameters
        ----------
        method : ResponseFit, optional
            By default :class:`~napari_crfdeblur.estimate.MaximumLikelihood`.
        per_channel : bool
            One response for each color channel.
        others : sequence of layers or files
            Further photos of the same camera, by layer, name of a layer, or path; their edges
            are those of the session, or found automatically.

        Raises
        ------
        CrfDeblurError
            There are no edges, or they cannot determine a response.
        """
        return self.do(
            steps.estimating_response(self, method, per_channel=per_channel, others=others)
        )

    def set_response(self, curve: Response) -> Fitted:
        """Use a response that is known: one curve, or one for each channel."""
        return self.do(steps.setting_response(self, curve))

    def load_response(self, path: Path | str) -> Fitted:
        """Use the response in a JSON file."""
        curves = read_responses(Path(path))
        return self.set_response(curves[0] if len(curves) == 1 else curves)
