"""Verbs that find the blur: one PSF, or those of all parts."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from napari.layers import Image as ImageLayer
from napari.layers import Points, Shapes

from ..._typing import FloatArray
from ...deconvolution.tiles import Region
from ...errors import CrfDeblurError
from ...pipeline import DeblurOptions, Intermediates, PhotoStack, Stage, walking
from ...pipeline.blur import check_fit
from ...pipeline.intermediates import made
from ...pipeline.trial import LightTrial
from ...progress import Job, Progress
from ...psf import Beads, PsfAt, PsfEstimate, PsfEstimator, PsfField, PsfStatus, as_psf
from .. import outputs
from ..blur_files import read_blur
from ..pixels import kernel_of, unwrapped
from ..pointing import method_drawn_on
from ..regions import AxisSpan
from .state import EdgeSet, Fitted, Sought
from .step import Step, at_once
from .workspace import Workspace

ALL_OF_IT = (
    "PSFs of parts are found in the whole picture: leave out the region, or look for one PSF"
)
PLACES = "places are those of the whole picture: leave out the region"
PLACED = (PsfAt, Beads)
BEAD = 31  # pixels around a point: most beads of a microscope are smaller
NO_EDGES = "there are no edges to find the PSF from; find or draw edges first"


class BlurVerbs(Workspace):
    """Verbs of a session that find the blur: one PSF, or those of all parts."""

    def estimate_psf(
        self,
        method: PsfEstimator | None = None,
        *,
        region: Sequence[AxisSpan] | None = None,
        regions: int | tuple[int, int] | None = None,
    ) -> PsfEstimate:
        """Estimate the PSF in linear light; it is shown as a layer beside the photo.

        Parameters
        ----------
        method : PsfEstimator, optional
            By default :class:`~napari_crfdeblur.psf.Portfolio` of the size of the blur.
            :class:`~napari_crfdeblur.psf.RadonFit` finds it from the edges of the session alone,
            :class:`~napari_crfdeblur.psf.RadonMap` from the picture and these edges.
        region : sequence of (start, stop), optional
            For each axis of the photo; by default the plane that is shown. Edges count wherever
            they lie.
        regions : int or (int, int), optional
            Rows and columns of parts, or parts along the longer side, each of which gets a PSF
            of its own (``state.field``), for a camera that turned; by default one PSF serves
            the whole photo. That of the whole is found, and returned, all the same.

        Raises
        ------
        CrfDeblurError
            There is no response, the picture shows too little structure, or there are no edges
            for a method that needs them.
        """
        return self.do(estimating_psf(self, method, region=region, regions=regions))

    def use_drawn_psf(self, layer: Points | Shapes, *, size: int = BEAD) -> PsfEstimate:
        """Use the PSF that a layer points to, in the plane that is shown.

        Parameters
        ----------
        layer : napari.layers.Points or napari.layers.Shapes
            Points on beads, stars or streaks; or shapes, of which the last counts: a rectangle
            around one streak or point, or a path on which the camera moved.
        size : int
            Side in pixels of the box around each point, odd: a little more than the PSF.

        Raises
        ------
        CrfDeblurError
            There is no response, or what is drawn does not show the PSF.
        """
        return self.do(estimating_psf(self, method_drawn_on(layer, self.source()[0], size)))

    def set_psf(
        self, psf: FloatArray, *, edited: bool = False, field: PsfField | None = None
    ) -> PsfEstimate:
        """Use a PSF that is known.

        Parameters
        ----------
        psf : ndarray, shape (H, W) or (D, H, W)
            Non-negative, scaled to sum 1; its origin is the center pixel. With one of three
            dimensions, stacks are restored as volumes of their last three axes.
        edited : bool
            Whether it is an estimate changed by hand, which is said of it from then on.
        field : PsfField, optional
            PSFs of the parts of the photo, if they differ; `psf` is that of the whole.

        Raises
        ------
        CrfDeblurError
            It is no PSF, has more dimensions than the photo, or `field` is that of a picture
            of other sides.
        """
        return self.do(setting_psf(self, psf, edited=edited, field=field))

    def load_psf(self, path: Path | str) -> PsfEstimate:
        """Use the PSF in a picture, a stack of pictures, an array file, or what was exported."""
        psf, field = read_blur(Path(path))
        return self.set_psf(psf, field=field)

    def use_psf_of(self, layer: ImageLayer) -> PsfEstimate:
        """Use the PSF in an image layer, as it is now."""
        return self.set_psf(kernel_of(unwrapped(layer), self.photo))


def estimating_psf(
    session: Workspace,
    method: PsfEstimator | None = None,
    *,
    region: Sequence[AxisSpan] | None = None,
    regions: int | tuple[int, int] | None = None,
) -> Step[Intermediates, PsfEstimate]:
    """Step of :meth:`BlurVerbs.estimate_psf`."""
    photo, source = session.source()
    fitted = session.required_response()
    options = DeblurOptions(psf=method, regions=regions)
    where = session.plane(None) if region is None else session.region(region)
    if regions is not None and where[-2:] != source.whole[-2:]:
        raise CrfDeblurError(ALL_OF_IT)
    if isinstance(method, PLACED) and where[-2:] != source.whole[-2:]:
        raise CrfDeblurError(PLACES)
    edges = session.state.edges
    if method is not None and method.needs_edges:
        if edges is None:
            raise CrfDeblurError(NO_EDGES)
        where = edges.plane  # of which the whole is looked at

    @at_once
    def finish(have: Intermediates) -> PsfEstimate:
        psf = made(have.psf, "a PSF")
        used = method or have.chosen["psf"]
        whole = where[-2:] == source.whole[-2:]
        sought = Sought(used, fitted, edges, where, regions) if whole else None
        _put(session, photo, psf, have.field, sought)
        session.say_trust(None, psf, have.field)
        return psf

    return Step("estimating the PSF", _seeking(source, where, fitted, edges, options), finish)


def setting_psf(
    session: Workspace,
    psf: FloatArray,
    *,
    edited: bool = False,
    field: PsfField | None = None,
) -> Step[PsfEstimate, PsfEstimate]:
    """Step of :meth:`BlurVerbs.set_psf`."""
    photo, source = session.source()
    given = PsfEstimate(as_psf(psf), PsfStatus.EDITED if edited else PsfStatus.GIVEN)
    check_fit(given.psf if field is None else field, source.shape, source.name)

    def job() -> Job[PsfEstimate]:
        yield Progress("given PSF", 0, 1)
        return given

    @at_once
    def finish(estimate: PsfEstimate) -> PsfEstimate:
        return _put(session, photo, estimate, field, None)

    return Step("taking the PSF", job(), finish)


def _seeking(
    source: PhotoStack,
    where: Region,
    fitted: Fitted,
    edges: EdgeSet | None,
    options: DeblurOptions,
) -> Job[Intermediates]:
    """Long job: the PSF of a plane or a part of it, and those of its parts if it is divided."""
    yield Progress("reading the photo", 0, 1)
    have = Intermediates(
        source.photo(where),
        edges=edges.edges if edges and options.psf and options.psf.needs_edges else (),
        groups=(),
        response=fitted.responses,
        trial=LightTrial(),  # the user has the response before the eyes
    )
    return (yield from walking(have, options, start=Stage.LINEAR, until=Stage.FIELD))


def _put(
    session: Workspace,
    photo: ImageLayer,
    psf: PsfEstimate,
    field: PsfField | None,
    sought: Sought | None,
) -> PsfEstimate:
    state = replace(session.state_of(photo), psf=psf, field=field, sought=sought)
    outputs.show_psf(session, photo, state)
    session.commit(photo, state)
    return psf
