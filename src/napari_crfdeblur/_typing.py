"""Names for the array types in signatures; shapes and units are given in the docstrings."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.floating[Any]]
Image: TypeAlias = NDArray[Any]
BoolArray: TypeAlias = NDArray[np.bool_]
