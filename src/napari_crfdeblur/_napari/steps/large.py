"""Restoring into a file, tile by tile: for photos whose results do not fit into memory."""

from dataclasses import replace
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import psutil  # type: ignore[import-untyped]
from napari.layers import Image as ImageLayer

from ..._typing import Image
from ...deconvolution import Deconvolver
from ...errors import CrfDeblurError
from ...large import check_target, open_source, restore_large, storing
from ...large import sources as large
from ...pipeline import DEFAULT_METHOD
from ...progress import Job, Progress
from ...response import Response
from .. import outputs
from ..blurs import Blur, check_fit
from ..pixels import Region, Source, file_of
from ..state import Action
from ..step import Step, at_once
from ..workspace import Workspace

if TYPE_CHECKING:
    from dask.array import Array

TILE = 512  # rows and columns that are read from the file at a time, to be shown
SHARE = 0.5  # of the memory that is free: what results may take
GIGA = 1e9


def restoring_into(
    session: Workspace,
    path: Path | str,
    method: Deconvolver | None = None,
    *,
    overwrite: bool = False,
) -> Step[Any, ImageLayer]:
    """Step of :meth:`Session.restore_into`."""
    photo, source = session.source()
    fitted, blur = session.required_response(), session.required_blur()
    target = Path(path).absolute()
    check_fit(blur, source)
    check_target(target)
    if file_of(photo) is not None and Path(str(file_of(photo))).resolve() == target.resolve():
        raise CrfDeblurError(f"{target}: is the photo itself; give another name")
    if target.exists() and not overwrite:
        raise CrfDeblurError(f"{target}: is there already; give another name")
    action = Action.of("restore_into", path=str(target), method=method)
    used = method or DEFAULT_METHOD

    @at_once
    def finish(stored: Any) -> ImageLayer:
        state = session.state_of(photo).after(action)
        layer = outputs.photo_layer(session, photo, stored, source.whole, state)
        session.commit(photo, replace(state, restored=layer))
        session.say(f"wrote {target}")
        return layer

    return Step("restoring into a file", _into(source, fitted.curve, blur, used, target), finish)


def check_room(source: Source, region: Region) -> None:
    """Refuse what would take more than half of the free memory.

    Raises
    ------
    CrfDeblurError
        The three layers of the result: two of float32, and one like the photo.
    """
    values = prod(axis.stop - axis.start for axis in region) * (3 if source.rgb else 1)
    needed, free = values * (8 + source.dtype.itemsize), psutil.virtual_memory().available
    if needed > SHARE * free:
        raise CrfDeblurError(
            f"the results would take {needed / GIGA:.1f} GB of memory, of which {free / GIGA:.1f} "
            "are free: restore into a file, or a part of the photo"
        )


def _into(
    source: Source, curve: Response, blur: Blur, method: Deconvolver, target: Path
) -> "Job[Array]":
    """Long job: everything restored and written; returns what is in the file, to be read there."""
    import dask.array as da

    yield Progress("measuring the photo", 0, 1)
    lazy = restore_large(_in_unit(source), curve, blur, method, channels=source.rgb)
    if source.white is not None:
        lazy = da.map_blocks(source.recorded, lazy, dtype=source.dtype)
    yield from storing(lazy, target)
    return in_file(target, source.rgb)


def _in_unit(source: Source) -> Any:
    """The pixels as :func:`~.restore_large` takes them; with a white level, lazily in [0, 1]."""
    if source.white is None:
        return source.data
    import dask.array as da

    lazy = source.data if isinstance(source.data, da.Array) else da.from_array(source.data)
    return da.map_blocks(source.in_unit, lazy, dtype=np.float32)


def in_file(path: Path, rgb: bool = False) -> "Array":
    """A stored array of which only what is looked at is read."""
    import dask.array as da

    stored = _Stored(open_source(path))
    axes = 3 if rgb else 2
    sides = stored.shape[-axes:]
    tile = (*(min(TILE, side) for side in sides[:2]), *sides[2:])
    chunks = (*(1 for _ in stored.shape[:-axes]), *tile)
    # A name of its own: the file can be written anew, and dask keeps parts of it by name.
    lazy: Array = da.from_array(stored, chunks=chunks, name=False, meta=np.empty(0, stored.dtype))
    return lazy


class _Stored:
    """An open file as dask takes arrays."""

    def __init__(self, source: large.Source) -> None:
        self._source = source
        self.shape, self.dtype, self.ndim = source.shape, source.dtype, len(source.shape)

    def __getitem__(self, region: Region) -> Image:
        return self._source.read(
            tuple(slice(*own.indices(side)) for own, side in zip(region, self.shape, strict=True))
        )
