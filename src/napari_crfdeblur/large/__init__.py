"""Photos larger than memory: dask arrays, zarr, tiled TIFF, on threads or a cluster."""

from .lazy import restore_large
from .region import informative_region
from .sources import Source, open_source
from .statistics import measure_large
from .store import check_target, store, storing

__all__ = [
    "Source",
    "check_target",
    "informative_region",
    "measure_large",
    "open_source",
    "restore_large",
    "store",
    "storing",
]
