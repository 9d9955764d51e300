"""The widgets, one for each part of the path: thin views of the session that they share."""

from .batch import BatchDock
from .blur import BlurDock
from .deblur import DeblurDock
from .edges import EdgesDock
from .response import ResponseDock
from .restore import RestoreDock

__all__ = ["BatchDock", "BlurDock", "DeblurDock", "EdgesDock", "ResponseDock", "RestoreDock"]
