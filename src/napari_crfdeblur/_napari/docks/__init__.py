"""The widgets, one for each part of the path: thin views of the session that they share."""

from .deblur import DeblurDock

__all__ = ["DeblurDock"]
