"""The widgets, one for each part of the path: thin views of the session that they share."""

from .batch import BatchDock
from .deblur import DeblurDock

__all__ = ["BatchDock", "DeblurDock"]
