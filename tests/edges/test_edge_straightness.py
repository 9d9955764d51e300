"""Arcs are trimmed to what is straight, or rejected; straight edges stay whole."""

import numpy as np
import pytest
from scipy import ndimage

from napari_crfdeblur.edges import Edge, EdgeStatus, find_edges
from napari_crfdeblur.edges.picture import Picture
from napari_crfdeblur.edges.scales import Scales

FINE = 4  # samples of the scene in a pixel


def disk(radius, blur, seed=0):
    """A blurred disk, (M, N, 3), 8 bit."""
    shape = (round(2.5 * radius + 4 * blur), round(2.7 * radius + 4 * blur))
    row, column = np.ogrid[: shape[0] * FINE, : shape[1] * FINE]
    center = (shape[0] / 2 + 0.3) * FINE, (shape[1] / 2 - 0.4) * FINE
    inside = np.hypot(row - center[0], column - center[1]) < radius * FINE
    share = inside.reshape(shape[0], FINE, shape[1], FINE).mean(axis=(1, 3))
    share = ndimage.gaussian_filter(share, (blur / 5, blur / 6))
    light = share[..., None] * (0.5, -0.1, 0.3) + (0.1, 0.4, 0.2)
    noise = 0.003 * np.random.default_rng(seed).standard_normal(light.shape)
    return np.rint(255 * np.clip(light ** (1 / 2.2) + noise, 0, 1)).astype(np.uint8)


def largest(edge: Edge):
    return max(0.35, 0.05 * edge.width)


@pytest.mark.parametrize("radius", [25, 35, 45, 120])
@pytest.mark.parametrize("blur", [6, 12, 24])
def test_no_arc_is_accepted_that_bends(radius, blur):
    edges = find_edges(disk(radius, blur), blur_extent=blur)
    assert edges
    for edge in edges:
        # A tenth for what noise and 8 bits do to the fitted parabola.
        if edge.good:
            assert edge.length**2 / (8 * radius) < 1.1 * largest(edge)


def test_a_tight_arc_is_called_curved():
    edges = find_edges(disk(30, 6), blur_extent=6)
    assert not any(edge.good for edge in edges)
    assert any(edge.status is EdgeStatus.CURVED for edge in edges)


def test_the_middle_of_a_wide_arc_is_kept():
    good = [edge for edge in find_edges(disk(300, 8), blur_extent=8) if edge.good]
    assert len(good) > 4


@pytest.mark.parametrize(("extent", "steps"), [(5.0, (1, 1)), (40.0, (2, 4)), (80.0, (3, 9))])
def test_wide_blur_is_looked_at_in_smaller_pictures(extent, steps):
    photo = np.arange(700 * 900, dtype=np.float32).reshape(700, 900) / 630000
    scales = Scales.to_find(Picture.of(photo), extent)
    assert (scales.fine.step, scales.coarse.step) == steps
    assert np.allclose(scales.fine.planes()[0].mean(), photo.mean(), atol=0.01)
