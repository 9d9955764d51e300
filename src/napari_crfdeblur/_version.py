"""The version, read by the build and by :mod:`napari_crfdeblur`."""

__version__ = "0.1.0"
