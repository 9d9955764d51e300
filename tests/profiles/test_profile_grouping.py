from math import pi, radians

import numpy as np
import pytest
from blurred_bands import band

from napari_crfdeblur.edges import Edge
from napari_crfdeblur.profiles import ByEdge, ByOrientation, ByPolarity, sample_profiles
from napari_crfdeblur.profiles.group import circular_mean, cluster

COLORS = [[0.2, 0.5, 0.3], [0.7, 0.2, 0.6], [0.3, 0.6, 0.2]]


def test_orientations_cluster_across_the_wrap():
    angles = np.radians([179.5, 0.5, 90, 91, 45])
    clusters = cluster(angles, np.ones(5), radians(3))
    assert sorted(c.members for c in clusters) == [(0, 1), (2, 3), (4,)]
    (wrapped,) = (c for c in clusters if 0 in c.members)
    assert min(wrapped.orientation, pi - wrapped.orientation) < 1e-9


def test_no_member_is_farther_than_the_tolerance():
    rng = np.random.default_rng(1)
    angles, weights = rng.uniform(0, pi, 200), rng.uniform(0.1, 1, 200)
    clusters = cluster(angles, weights, 0.05)
    assert sorted(i for c in clusters for i in c.members) == list(range(200))
    for c in clusters:
        apart = np.abs((angles[list(c.members)] - c.orientation + pi / 2) % pi - pi / 2)
        assert 0 <= c.orientation < pi
        assert apart.max() <= 0.05


def test_the_mean_orientation_is_in_range_at_the_wrap():
    assert circular_mean(np.array([pi - 1e-17, 0.0]), np.ones(2)) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("tolerance", [0, -1, pi, float("nan")])
@pytest.mark.parametrize("kind", [ByOrientation, ByPolarity, ByEdge])
def test_a_tolerance_that_is_no_acute_angle_is_refused(kind, tolerance):
    with pytest.raises(ValueError, match="tolerance"):
        kind(tolerance)


def wrapped_edges():
    """Two photos' worth of nearly vertical bands, on both sides of the wrap, in one image."""
    top, first = band((120, 150), radians(0.6), 26, COLORS, 12)
    bottom, second = band((120, 150), radians(179.4), 26, COLORS, 12)
    moved = [
        Edge(
            (e.start[0] + 120, e.start[1]),
            (e.end[0] + 120, e.end[1]),
            e.polarity,
            e.width,
            e.contrast,
        )
        for e in second
    ]
    return np.concatenate([top, bottom]), first + moved


def test_edges_on_both_sides_of_the_wrap_are_sampled_in_one_direction():
    photo, edges = wrapped_edges()
    normals = [e.normal[1] for e in edges]
    assert min(normals) < 0 < max(normals)  # the edges' own normals are opposite
    (group,) = sample_profiles(photo, edges)
    share = (group.intensity - group.sides[:, :1]) / np.diff(group.sides, axis=1)
    # The blur is asymmetric: seen from the other side its shape would differ by .1 or more.
    assert np.abs(share - np.median(share, axis=0)).max() < 0.04
    assert np.abs(share - np.median(1 - share[:, ::-1], axis=0)).max() > 0.08


def test_by_polarity_keeps_rising_and_falling_rows_apart():
    photo, edges = wrapped_edges()
    groups = sample_profiles(photo, edges, grouping=ByPolarity())
    assert sorted(g.polarity for g in groups) == [-1, 1]
    for group in groups:
        assert (np.sign(np.diff(group.sides, axis=1)) == group.polarity).all()
    (both,) = sample_profiles(photo, edges)
    assert sum(len(g) for g in groups) == len(both) == 12


def test_by_edge_keeps_the_channels_of_each_edge_together():
    photo, edges = wrapped_edges()
    groups = sample_profiles(photo, edges, grouping=ByEdge())
    assert [len(g) for g in groups] == [3] * 4
    assert sorted({s.edge for g in groups for s in g.sources}) == [0, 1, 2, 3]


def test_a_tighter_tolerance_makes_more_groups():
    photo, edges = wrapped_edges()
    assert len(sample_profiles(photo, edges, grouping=ByOrientation(radians(0.1)))) == 2
