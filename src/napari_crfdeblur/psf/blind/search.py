"""The method proper of a blind estimator, as the steps around it see it."""

from collections.abc import Callable
from typing import TypeAlias

from ..._typing import FloatArray
from ...progress import Job
from .blurred import Blurred

Search: TypeAlias = Callable[[Blurred, int], Job[FloatArray]]
"""``search(blurred, size)``: a job that gives a PSF of `size` x `size` pixels, non-negative, of
sum 1; it reports progress up to its own total."""
