"""The verb of the whole path: from the pixels to the restored photo."""

from dataclasses import dataclass, replace

from napari.layers import Image as ImageLayer

from ...arguments import instance
from ...deconvolution.tiles import Region
from ...pipeline import DEFAULT_METHOD, DeblurOptions, Intermediates, PhotoStack, Stage, walking
from ...pipeline.intermediates import made
from ...progress import Job, Progress
from ...psf import GivenPsf
from .. import outputs
from .memory import check_room
from .products import Product, making, show_all
from .state import EdgeSet, Fitted, Sought, edge_set
from .step import Effects, Step
from .way import way_of
from .workspace import Workspace


class WholeVerbs(Workspace):
    """The verb of a session for the whole path."""

    def deblur(self, options: DeblurOptions | None = None) -> ImageLayer:
        """Do the whole path; edges that the session already has are used.

        Parameters
        ----------
        options : DeblurOptions, optional
            What is known, and the methods for the rest.
        """
        return self.do(deblurring(self, options))


@dataclass(frozen=True, slots=True, eq=False)
class Whole:
    """All that the path finds in a plane, and what it made of a region, if anything."""

    found: Intermediates
    product: Product | None


def deblurring(session: Workspace, options: DeblurOptions | None = None) -> Step[Whole, ImageLayer]:
    """Step of :meth:`WholeVerbs.deblur`."""
    photo, source = session.source()
    options = DeblurOptions() if options is None else options
    instance(options, DeblurOptions, "DeblurOptions")
    before = session.state.edges if options.edges is None else None
    plane = before.plane if before else session.plane(None)
    check_room(source, source.whole)

    def finish(whole: Whole) -> Effects[ImageLayer]:
        yield from keep_whole(
            session, photo, source, whole, options, plane, source.whole, before=before
        )
        state = session.state_of(photo)
        trust = whole.product.restored.trust if whole.product else None
        session.say_trust(state.fitted, state.psf, state.field, trust)
        return made(state.restored, "a result")

    job = _walking(source, plane, before, options)
    return Step("deblurring the photo", job, finish)


def keep_whole(
    session: Workspace,
    photo: ImageLayer,
    source: PhotoStack,
    whole: Whole,
    options: DeblurOptions,
    plane: Region,
    region: Region,
    *,
    before: EdgeSet | None = None,
) -> Effects[None]:
    """Keep and show all that the path has found and made, as far as it went.

    Parameters
    ----------
    session : Workspace
    photo : napari.layers.Image
    source : PhotoStack
    whole : Whole
    options : DeblurOptions
        How it was found.
    plane, region : tuple of slice
        Where it was found, and what was restored.
    before : EdgeSet, optional
        Edges that there were already, and that were used.
    """
    have, state = whole.found, session.state_of(photo)
    edges = before or (edge_set(have, plane, options) if have.edges else None)
    if edges is not before:
        state = state.with_edges(edges)
    if have.response is not None:
        state = replace(state, fitted=fitted_of(have, edges, options))
    if have.psf is not None and state.fitted is not None:
        used = options.psf or have.chosen["psf"]
        as_it_is = isinstance(used, GivenPsf) or _settled(have)
        sought = None if as_it_is else Sought(used, state.fitted, edges, plane, options.regions)
        state = replace(state, psf=have.psf, field=have.field, sought=sought)
    session.commit(photo, state)
    yield
    if have.psf is not None:
        outputs.show_psf(session, photo, state)
        yield
    if whole.product is not None and state.fitted is not None:
        way = way_of(state, state.fitted, options.method or DEFAULT_METHOD)
        yield from show_all(session, photo, source, way, region, whole.product, have.chosen)


def fitted_of(have: Intermediates, edges: EdgeSet | None, options: DeblurOptions) -> Fitted:
    """The response that the path has found, and what it was found from."""
    response = made(have.response, "a response")
    if not options.response.needs_profiles or _settled(have):
        return Fitted(response)
    return Fitted(response, have.groups or (), edges, options.response)


def _settled(have: Intermediates) -> bool:
    """Whether another response was taken than the one found, by trial with the PSF."""
    return have.trial is not None and have.trial.prefers_recorded


def _walking(
    source: PhotoStack, plane: Region, before: EdgeSet | None, options: DeblurOptions
) -> Job[Whole]:
    """Long job: what is found in a plane, and all restored with it."""
    yield Progress("reading the photo", 0, 1)
    have = Intermediates(source.photo(plane), edges=before.edges if before else None)
    have = yield from walking(have, options, until=Stage.FIELD)
    psf = made(have.psf, "a PSF").psf
    product = yield from making(
        source,
        source.whole,
        made(have.response, "a response"),
        psf if have.field is None else have.field,
        replace(options, method=options.method or DEFAULT_METHOD),
    )
    return Whole(have, product)
