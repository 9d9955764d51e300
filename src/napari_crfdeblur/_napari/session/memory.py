"""Whether the results of a step fit into memory."""

from math import prod

import psutil  # type: ignore[import-untyped]

from ...deconvolution.tiles import Region
from ...errors import CrfDeblurError
from ...pipeline import PhotoStack

SHARE = 0.5  # of the memory that is free: what results may take
GIGA = 1e9


def check_room(source: PhotoStack, region: Region) -> None:
    """Refuse what would take more than half of the free memory.

    Raises
    ------
    CrfDeblurError
        The layers of the result: two of float32, one like the photo, and what says how far to
        believe it, three planes of float32 for all channels.
    """
    pixels = prod(axis.stop - axis.start for axis in region)
    channels = 3 if source.rgb else 1
    needed = pixels * (channels * (8 + source.dtype.itemsize) + 12)
    free = psutil.virtual_memory().available
    if needed > SHARE * free:
        raise CrfDeblurError(
            f"the results would take {needed / GIGA:.1f} GB of memory, of which {free / GIGA:.1f} "
            "are free: restore into a file, or a part of the photo"
        )
