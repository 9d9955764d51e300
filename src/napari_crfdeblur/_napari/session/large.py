"""Restoring into a file, tile by tile: for photos whose results do not fit into memory."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from napari.layers import Image as ImageLayer

from ...deconvolution import Deconvolver
from ...errors import CrfDeblurError
from ...io import check_apart
from ...large import check_target, open_source, restore_large, storing
from ...large.deblur import StoredArray
from ...pipeline import DEFAULT_METHOD, DeblurOptions, PhotoStack, Pixels, Stage
from ...pipeline.blur import Blur, check_fit
from ...pipeline.intermediates import made
from ...pipeline.record import identifying
from ...progress import Job, Progress
from ...response import Response
from .. import outputs
from ..pixels import file_of
from .step import Step, at_once
from .way import record_of, way_of
from .workspace import Workspace

if TYPE_CHECKING:
    from dask.array import Array

TILE = 512  # rows and columns that are read from the file at a time, to be shown


class IntoFileVerbs(Workspace):
    """The verb of a session that restores a photo into a file."""

    def restore_into(
        self, path: Path | str, method: Deconvolver | None = None, *, overwrite: bool = False
    ) -> ImageLayer:
        """Restore the photo into a file, tile by tile, and show it from there.

        For photos and stacks, dask arrays among them, whose results do not fit into memory.

        Parameters
        ----------
        path : Path
            A BigTIFF of tiles (``.tif``) or a folder of zarr (``.zarr``); it appears under this
            name when it is complete.
        method : Deconvolver, optional
            By default :class:`~napari_crfdeblur.deconvolution.LocalShrinkage`.
        overwrite : bool
            Whether a file that is there already is replaced.

        Raises
        ------
        CrfDeblurError
            The file is there, or cannot be written.
        """
        return self.do(restoring_into(self, path, method, overwrite=overwrite))


@dataclass(frozen=True, slots=True, eq=False)
class Written:
    """What is in the file, read there, and what tells it and the photo from others."""

    lazy: Any
    photo: Pixels
    result: Pixels


def restoring_into(
    session: Workspace,
    path: Path | str,
    method: Deconvolver | None = None,
    *,
    overwrite: bool = False,
) -> Step[Written, ImageLayer]:
    """Step of :meth:`IntoFileVerbs.restore_into`."""
    photo, source = session.source()
    fitted, blur = session.required_response(), session.required_blur()
    target = Path(path).absolute()
    check_fit(blur, source.shape, source.name)
    check_target(target)
    own = file_of(photo)
    check_apart([] if own is None else [Path(own)], [target])
    if target.exists() and not overwrite:
        raise CrfDeblurError(f"{target}: is there already; give another name")
    used = method or DEFAULT_METHOD
    way = way_of(session.state, fitted, used)

    @at_once
    def finish(written: Written) -> ImageLayer:
        state = session.state_of(photo)
        record = record_of(
            source,
            way,
            Stage.REAPPLY,
            photo=written.photo,
            result=written.result,
            tiled=True,
        )
        layer = outputs.photo_layer(session, photo, written.lazy, source.whole, state, record)
        session.commit(photo, replace(state, restored=layer, record=record))
        session.say(f"wrote {target}")
        return layer

    job = _into(source, fitted.curve, blur, way.options, target)
    return Step("restoring into a file", job, finish)


def _into(
    source: PhotoStack, curve: Response, blur: Blur, options: DeblurOptions, target: Path
) -> "Job[Written]":
    """Long job: everything restored and written, to be read from the file."""
    import dask.array as da

    yield Progress("measuring the photo", 0, 1)
    lazy = restore_large(
        _in_unit(source),
        curve,
        blur,
        made(options.method, "a method"),
        channels=source.rgb,
        guard=options.guard,
    )
    if source.white is not None:
        lazy = da.map_blocks(source.recorded, lazy, dtype=source.dtype)
    yield from storing(lazy, target)
    stored = in_file(target, source.rgb)
    photo = yield from identifying(source)
    result = yield from identifying(PhotoStack(stored, source.rgb, name=source.name))
    return Written(stored, photo, result)


def _in_unit(source: PhotoStack) -> Any:
    """The pixels as :func:`~.restore_large` takes them; with a white level, lazily in [0, 1]."""
    if source.white is None:
        return source.data
    import dask.array as da

    lazy = source.data if isinstance(source.data, da.Array) else da.from_array(source.data)
    return da.map_blocks(source.in_unit, lazy, dtype=np.float32)


def in_file(path: Path, rgb: bool = False) -> "Array":
    """A stored array of which only what is looked at is read."""
    import dask.array as da

    stored = StoredArray(open_source(path))
    axes = 3 if rgb else 2
    sides = stored.shape[-axes:]
    tile = (*(min(TILE, side) for side in sides[:2]), *sides[2:])
    chunks = (*(1 for _ in stored.shape[:-axes]), *tile)
    # A name of its own: the file can be written anew, and dask keeps parts of it by name.
    lazy: Array = da.from_array(stored, chunks=chunks, name=False, meta=np.empty(0, stored.dtype))
    return lazy
