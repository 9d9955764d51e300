"""The napari plugin: a session for each viewer, docks, samples, readers and writers.

Alone in knowing napari. Loads nothing by itself, so that napari starts as fast as without it.
"""
