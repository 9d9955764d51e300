import numpy as np
import pytest
from blurred_bands import band, shares

from napari_crfdeblur.edges import Edge
from napari_crfdeblur.profiles import CommonShape, EndPoints, sample_profiles

SHAPE = (131, 170)
LEVELS = [[0.03, 0.5, 0.2], [0.8, 0.1, 0.55], [0.35, 0.6, 0.05]]


def displaced(edge, offset):
    shift = np.multiply(edge.normal, offset)
    start, end = (tuple(np.array(p) + shift) for p in (edge.start, edge.end))
    return Edge(start, end, edge.polarity, edge.width, edge.contrast)


def misalignment(group, gamma):
    """Shift of each row against the median row, in linear light, pixels."""
    rows = shares(group, gamma)
    middle = np.median(rows, axis=0)
    slope = np.gradient(middle, group.position)
    return (middle - rows) @ slope / (slope @ slope)


@pytest.mark.parametrize("gamma", [1.0, 1.8, 2.2])
@pytest.mark.parametrize("extent", [8, 20])
def test_rows_align_within_a_fifth_of_a_pixel_whatever_the_response(gamma, extent):
    photo, edges = band(SHAPE, 0.3, 1.5 * extent, LEVELS, extent, gamma=gamma, noise=0.003)
    wrong = [displaced(e, d) for e, d in zip(edges, (0.08 * extent, -0.05 * extent), strict=True)]
    (group,) = sample_profiles(photo, wrong, alignment=CommonShape())
    assert np.abs(misalignment(group, gamma)).max() < 0.2


def test_end_points_align_a_linear_photo():
    photo, edges = band(SHAPE, 0.3, 30, LEVELS, 20, noise=0.003)
    wrong = [displaced(e, d) for e, d in zip(edges, (1.6, -1.1), strict=True)]
    (group,) = sample_profiles(photo, wrong, alignment=EndPoints())
    assert np.abs(misalignment(group, 1.0)).max() < 0.3


@pytest.mark.parametrize("method", [CommonShape(), EndPoints()])
def test_the_transition_is_in_the_middle_of_the_samples(method):
    photo, edges = band(SHAPE, 0.3, 30, LEVELS, 20, noise=0.003)
    (group,) = sample_profiles(photo, [displaced(e, 1.5) for e in edges], alignment=method)
    share = np.median(shares(group), axis=0)
    first, last = np.interp([0.05, 0.95], share, group.position)
    assert abs(first + last) / 2 < 0.6
    assert share[0] < 0.02
    assert share[-1] > 0.98
    assert np.allclose(np.diff(group.position), group.position[1] - group.position[0])


def test_the_end_points_do_not_move_with_the_response_as_the_middle_does():
    linear, edges = band(SHAPE, 0.3, 30, LEVELS, 20)
    curved, _ = band(SHAPE, 0.3, 30, LEVELS, 20, gamma=2.2)
    method = EndPoints(level=0.02)
    apart = []
    for photo, gamma in ((linear, 1.0), (curved, 2.2)):
        (group,) = sample_profiles(photo, edges, alignment=method)
        apart.append(np.ptp(misalignment(group, gamma)))
    assert apart[0] < 0.2
    assert apart[1] < 1.0  # middles are several pixels apart
