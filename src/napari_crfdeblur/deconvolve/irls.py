"""Deconvolution with a sparse prior by reweighted least squares: slow, and the best."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .._typing import FloatArray
from ..boundary import extend
from ..fourier import ComplexArray, forward, inverse, otf, power
from ..progress import Job, Progress
from .base import Deconvolver
from .noise import contrast, relative_noise
