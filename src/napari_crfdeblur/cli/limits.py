"""What options ask for that depends on the photo: refused as soon as its size is known."""

from argparse import Namespace
from pathlib import Path

from ..errors import CrfDeblurError
from ..psf.field.regions import LEAST_SIDE

SMALLEST_PSF = 3  # rows and columns


def check_fits(arguments: Namespace, path: Path, shape: tuple[int, int]) -> None:
    """Refuse a blur wider than the photo, and parts too small for any PSF.

    Parameters
    ----------
    arguments : Namespace
    path : Path
        Of the photo.
    shape : (int, int)
        Its rows and columns.
    """
    extent = getattr(arguments, "blur_extent", None)
    if extent is not None and extent > max(shape):
        raise CrfDeblurError(
            f"{path}: has {shape[0]} x {shape[1]} pixels; give a --blur-extent within them"
        )
    grid = getattr(arguments, "varying", None)
    if isinstance(grid, tuple):
        narrowest = min(side / count for side, count in zip(shape, grid, strict=True))
        if narrowest < LEAST_SIDE * SMALLEST_PSF:
            raise CrfDeblurError(
                f"{path}: has {shape[0]} x {shape[1]} pixels, too few for {grid[0]} x {grid[1]} "
                "parts with a PSF each; ask for fewer with --varying"
            )
