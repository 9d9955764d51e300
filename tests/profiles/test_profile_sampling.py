from math import pi

import numpy as np
import pytest
from blurred_bands import band, blurred_step, shares

from napari_crfdeblur.edges import Edge, EdgeStatus, find_edges
from napari_crfdeblur.profiles import (
    ByPolarity,
    Channels,
    EndPoints,
    of_channel,
    sample_profiles,
)

SHAPE = (131, 170)
GREY = [[0.2], [0.7], [0.35]]
COLORS = [[0.2, 0.5, 0.3], [0.7, 0.2, 0.6], [0.3, 0.6, 0.2]]
ORIENTATIONS = np.radians([0, 0.3, 12, 45, 63, 90, 90.2, 135, 179.7])


def closest(group, rows, extent):
    """Largest difference of profiles from the formula, at the shift that fits best.

    The origin is a convention (the middle of the transition); the shape is not.
    """
    offsets = np.linspace(-extent / 2, extent / 2, 2001)
    places = group.position + offsets[:, None]
    shapes = blurred_step(places, group.orientation, extent)
    best = ((rows.mean(axis=0) - shapes) ** 2).sum(axis=1).argmin()
    return np.abs(rows - shapes[best]).max()


@pytest.mark.parametrize("angle", ORIENTATIONS)
@pytest.mark.parametrize("extent", [8, 16])
def test_profiles_of_a_linear_photo_are_the_projected_blur(angle, extent):
    photo, edges = band(SHAPE, angle, 1.6 * extent, GREY, extent)
    (group,) = sample_profiles(photo[..., 0], edges)
    assert len(group) == 2
    # An edge along the pixel grid is seen at every whole pixel only: 2 % are lost of a step
    # that rises within 3 pixels, as it does here under the smaller blur.
    assert closest(group, shares(group), extent) < (0.02 if extent == 8 else 0.004)


@pytest.mark.parametrize("angle", ORIENTATIONS)
def test_both_polarities_share_one_shape_sampled_in_one_direction(angle):
    photo, edges = band(SHAPE, angle, 24, COLORS, 14, noise=0.004)
    (group,) = sample_profiles(photo, edges)
    rises = np.sign(group.sides[:, 1] - group.sides[:, 0])
    assert set(rises) == {-1, 1}
    assert group.polarity == 0
    rows = shares(group)
    # Five standard deviations of profiles from 80 pixels, and a tenth of a pixel of alignment.
    assert np.abs(rows - np.median(rows, axis=0)).max() < 0.05


def test_sides_are_the_recorded_levels_before_and_after():
    photo, edges = band(SHAPE, 0.4, 26, GREY, 12, gamma=2.2)
    (group,) = sample_profiles(photo[..., 0], edges)
    before, within, after = np.array(GREY)[:, 0] ** (1 / 2.2)
    # 1 % of the blur's tails lies beyond what counts as its width.
    assert np.allclose(group.sides, [[before, within], [within, after]], atol=0.004)


def test_variance_predicts_the_scatter_of_repeated_photos():
    repeats = []
    for seed in range(40):
        photo, edges = band(SHAPE, 0.3, 26, GREY, 14, noise=0.02, seed=seed)
        # A fixed origin: alignment would move every profile a little.
        (group,) = sample_profiles(photo[..., 0], edges, alignment=Unmoved())
        repeats.append(group)
    for name, predicted in (("intensity", "variance"), ("sides", "sides_variance")):
        scatter = np.var([getattr(g, name) for g in repeats], axis=0, ddof=1)
        ratio = scatter / np.mean([getattr(g, predicted) for g in repeats], axis=0)
        # Each variance of 40 repeats is known to 22 %; their mean over many samples better.
        assert 0.8 < ratio.mean() < 1.25


class Unmoved(EndPoints):
    def shifts(self, groups):
        return [np.zeros(int(rows.edge.max()) + 1) for rows in groups]


def test_count_is_the_number_of_pixels_near_each_sample():
    photo, edges = band(SHAPE, 0.3, 26, GREY, 14)
    (group,) = sample_profiles(photo[..., 0], edges, alignment=Unmoved())
    # Pixels within a tenth of the width on both sides of the sample, along the whole edge.
    expected = 0.2 * edges[0].width * edges[0].length
    assert np.allclose(group.count, expected, rtol=0.05)


def test_rounding_alone_leaves_a_positive_variance():
    photo, edges = band(SHAPE, 0.3, 26, GREY, 14)
    (group,) = sample_profiles(np.rint(photo[..., 0] * 255).astype(np.uint8), edges)
    assert (group.variance > 0).all()
    assert (group.sides_variance > 0).all()


@pytest.mark.parametrize(("dtype", "step"), [(np.uint8, 1 / 255), (np.uint16, 1 / 65535)])
def test_integers_give_the_same_profiles_as_floats(dtype, step):
    photo, edges = band(SHAPE, 0.3, 26, GREY, 14)
    rounded = np.rint(photo[..., 0] / step).astype(dtype)
    (expected,) = sample_profiles(photo[..., 0], edges, alignment=Unmoved())
    (group,) = sample_profiles(rounded, edges, alignment=Unmoved())
    assert np.abs(group.intensity - expected.intensity).max() < step


def test_each_channel_is_a_row_that_says_which_it_is():
    photo, edges = band(SHAPE, 0.3, 26, COLORS, 14)
    (group,) = sample_profiles(photo, edges, index=3)
    assert sorted((s.edge, s.channel) for s in group.sources) == [
        (e, c) for e in range(2) for c in range(3)
    ]
    assert {s.image for s in group.sources} == {3}
    (green,) = of_channel([group], 1)
    assert len(green) == 2
    assert np.abs(shares(group) - shares(group)[0]).max() < 0.01


def test_luminance_is_the_mean_of_the_channels():
    photo, edges = band(SHAPE, 0.3, 26, COLORS, 14)
    (group,) = sample_profiles(photo, edges, channels=Channels.LUMINANCE)
    means = np.mean(COLORS, axis=1)
    assert np.allclose(group.sides, [means[:2], means[1:]], atol=0.004)
    assert [s.channel for s in group.sources] == [0, 0]


def test_alpha_is_not_sampled():
    photo, edges = band(SHAPE, 0.3, 26, COLORS, 14)
    alpha = np.concatenate([photo, np.random.default_rng(0).uniform(size=(*SHAPE, 1))], axis=2)
    (group,) = sample_profiles(alpha, edges)
    (expected,) = sample_profiles(photo, edges)
    assert np.array_equal(group.intensity, expected.intensity)


def test_clipped_and_flat_channels_are_left_out():
    levels = [[0.2, 0.4, 0.3], [1.3, 0.41, 0.6], [0.2, 0.4, 0.2]]
    photo, edges = band(SHAPE, 0.3, 26, levels, 14)
    (group,) = sample_profiles(photo, edges)
    assert {s.channel for s in group.sources} == {2}


def test_bad_edges_are_passed_over():
    photo, (first, second) = band(SHAPE, 0.3, 26, GREY, 14)
    bad = Edge(first.start, first.end, status=EdgeStatus.VARIES)
    (group,) = sample_profiles(photo[..., 0], [bad, second])
    assert [s.edge for s in group.sources] == [1]
    assert sample_profiles(photo[..., 0], [bad]) == []
    assert sample_profiles(photo[..., 0], []) == []


def test_an_edge_that_needs_more_than_the_image_shows_is_left_out():
    photo, edges = band(SHAPE, pi / 2, 26, GREY, 14)
    assert sample_profiles(photo[36:, :, 0], [shifted(edges[0], -36)]) == []


def shifted(edge, rows):
    (r0, c0), (r1, c1) = edge.start, edge.end
    return Edge((r0 + rows, c0), (r1 + rows, c1), edge.polarity, edge.width, edge.contrast)


def test_photos_of_one_camera_pool_by_adding_their_lists():
    groups = []
    for index, (angle, extent) in enumerate([(0.3, 14), (0.3, 8)]):
        photo, edges = band(SHAPE, angle, 26, GREY, extent)
        groups += sample_profiles(photo[..., 0], edges, index=index)
    assert [{s.image for s in g.sources} for g in groups] == [{0}, {1}]
    # Each photo has its own blur, hence groups and supports of its own.
    assert np.ptp(groups[0].position) > np.ptp(groups[1].position)


@pytest.mark.parametrize("gamma", [1.0, 2.2])
def test_found_edges_give_profiles_of_one_shape(gamma):
    photo, _ = band((180, 230), 0.3, 30, COLORS, 16, gamma=gamma, noise=0.004)
    edges = find_edges(photo, blur_extent=16)
    assert sum(e.good for e in edges) == 2
    (group,) = sample_profiles(photo, edges)
    rows = shares(group, gamma)
    assert np.abs(rows - np.median(rows, axis=0)).max() < 0.05
    rising, falling = sample_profiles(photo, edges, grouping=ByPolarity())
    assert {rising.polarity, falling.polarity} == {-1, 1}
