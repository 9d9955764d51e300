"""Results larger than memory, stored tile by tile: whole at the end, or not there at all."""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import accumulate, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from .._typing import Image
from ..crew.workers import Workers, workers
from ..deconvolution.tiles import Region
from ..errors import CrfDeblurError
from ..io import check_folder, check_output
from ..io.files import replacing
from ..io.images import TIFF
from ..photo import ALPHA
from ..progress import Job, Progress, drain
from .sources import ZARR, Source, open_source, zarr_module
from .tiff_writer import tiff_writer

if TYPE_CHECKING:
    from dask.array import Array

SUFFIXES = (*TIFF, ZARR)


class Writer(Protocol):
    """What takes the tiles of a result."""

    def write(self, region: Region, pixels: Image) -> None:
        """Keep the pixels of a region."""


def store(array: "Array", path: Path, *, scheduler: str | None = None) -> None:
    """Compute an array and store it, with no more in memory than the tiles in work.

    Parameters
    ----------
    array : dask array
        Such as :func:`restore_large` makes; each of its chunks is computed once.
    path : Path
        A BigTIFF of tiles (``.tif``) or a folder of zarr (``.zarr``). It appears under this
        name when it is complete; what was there is kept until then.
    scheduler : str, optional
        Address of the scheduler of a ``dask.distributed`` cluster; by default the threads of
        this process do the work. The result is the same.

    Raises
    ------
    CrfDeblurError
        The place cannot be written, the disk is full, the scheduler does not answer or is lost,
        there are no workers, or what is computed says so.
    """
    drain(storing(array, path, scheduler=scheduler))


def storing(
    array: "Array",
    path: Path,
    *,
    scheduler: str | None = None,
    source: Source | None = None,
) -> Job[None]:
    """Job of :func:`store`: reports progress, can be stopped.

    Parameters
    ----------
    array, path, scheduler
        As for :func:`store`.
    source : Source, optional
        Looked at once more at the end: if it has changed meanwhile, there is no result.
    """
    check_target(path)
    yield Progress("tiles", 0, 1)
    with _target(path, array) as writer, workers(scheduler) as crew:
        yield from _filling(array, writer, crew)
        if source is not None:
            source.check()


def check_target(path: Path) -> None:
    """Refuse, before any work, a place that cannot be written."""
    if path.suffix.lower() != ZARR:
        check_output(path, SUFFIXES)
        return
    zarr = zarr_module(path)
    check_folder(path.parent)
    if not path.exists():
        return
    open_source(path)  # what is replaced has to be of the same kind
    if not path.is_dir() or isinstance(zarr.open(path, mode="r"), zarr.Group):
        raise CrfDeblurError(
            f"{path}: is there already, and is not a single array of zarr; choose another name"
        )


def _filling(array: "Array", writer: Writer, crew: Workers) -> Job[None]:
    """Job: compute and write all chunks, a few at a time, in whatever order they come."""
    numbers = iter(np.ndindex(*array.numblocks))
    total, done = array.npartitions, 0
    pending: dict[Any, Region] = {}
    try:
        while done < total:
            for number in islice(numbers, max(0, crew.size + 1 - len(pending))):
                pending[crew.compute(array.blocks[number])] = region_of(array.chunks, number)
            for task in crew.done(pending):
                writer.write(pending.pop(task), crew.result(task))
                del task
                done += 1
            yield Progress("tiles", done, total)
    finally:
        crew.drop(pending)


def region_of(chunks: tuple[tuple[int, ...], ...], number: tuple[int, ...]) -> Region:
    """Where a chunk lies in its array."""
    starts = [[0, *accumulate(sides)] for sides in chunks]
    return tuple(slice(own[i], own[i + 1]) for own, i in zip(starts, number, strict=True))


@contextmanager
def _target(path: Path, array: "Array") -> Iterator[Writer]:
    """Room for a result beside its place, which it takes if all goes well."""
    with replacing(path) as temporary:
        if path.suffix.lower() == ZARR:
            yield _ZarrWriter(temporary, array)
            return
        color = array.ndim > 2 and array.shape[-1] in (3, ALPHA)
        with tiff_writer(temporary, array.shape, array.dtype, color) as writer:
            yield writer


class _ZarrWriter:
    def __init__(self, folder: Path, array: "Array") -> None:
        zarr = zarr_module(folder)
        sides = tuple(max(each) for each in array.chunks)
        self._stored = zarr.create_array(
            folder, shape=array.shape, chunks=sides, dtype=array.dtype, overwrite=True
        )

    def write(self, region: Region, pixels: Image) -> None:
        self._stored[region] = pixels
