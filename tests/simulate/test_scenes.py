"""Scenes: exact drawing, known edges, the same scene for the same seed."""

from functools import cache

import numpy as np
import pytest

from napari_crfdeblur.edges.base import Edge, Line
from napari_crfdeblur.simulate import Scene, slanted_edges, step_image, street
from napari_crfdeblur.simulate.raster import coverage, paint
from napari_crfdeblur.simulate.scenes import edge_between
from napari_crfdeblur.simulate.truth import clean_edges


@cache
def a_street(rows, seed):
    return street((rows, 3 * rows // 2), seed=seed)


SCENES = {
    "steps": lambda: step_image((60, 90)),
    "slanted": lambda: slanted_edges((170, 220), seed=4, pitch=80),
    "slanted in color": lambda: slanted_edges((170, 220), seed=4, pitch=80, channels=3),
    "street": lambda: a_street(200, 1),
}


@pytest.fixture(scope="module", params=SCENES)
def scene(request):
    return SCENES[request.param]()


def test_scenes_are_light_of_the_shape_asked_for(scene):
    assert scene.linear.dtype == np.float32
    assert scene.linear.shape[:2] in {(60, 90), (170, 220), (200, 300)}
    assert scene.linear.min() >= 0
    assert scene.linear.max() <= 1


def test_scenes_are_read_only(scene):
    with pytest.raises(ValueError, match="read-only"):
        scene.linear[0, 0] = 0


def test_light_beside_each_edge_is_the_light_recorded_for_it(scene):
    assert len(scene.edges) >= 3
    for true in scene.edges:
        edge = Edge(true.line.start, true.line.end)
        middle = (np.array(edge.start) + edge.end) / 2
        for sign, level in ((-1, true.before), (1, true.after)):
            row, column = np.rint(middle + sign * 2.5 * np.array(edge.normal)).astype(int)
            if 0 <= row < scene.linear.shape[0] and 0 <= column < scene.linear.shape[1]:
                np.testing.assert_allclose(scene.linear[row, column], level, atol=3e-3)


@pytest.mark.parametrize("make", [slanted_edges, street])
def test_the_seed_decides_the_scene(make):
    known = (a_street(200, seed) for seed in (1, 0))
    drawn = (slanted_edges((200, 300), seed=seed) for seed in (1, 0))
    first, other = (scene.linear for scene in (known if make is street else drawn))
    same = make((200, 300), seed=1).linear
    np.testing.assert_array_equal(first, same)
    assert np.abs(first - other).max() > 0.1


def test_slanted_edges_have_many_directions_and_ranges_in_both_polarities():
    edges = slanted_edges((400, 600), seed=1, pitch=100).edges
    angles = [Edge(e.line.start, e.line.end).orientation for e in edges]
    assert len({round(angle, 1) for angle in angles}) > 15
    steps = np.array([e.after[0] - e.before[0] for e in edges])
    assert np.abs(steps).min() >= 0.2
    assert (steps > 0).sum() > 20
    assert (steps < 0).sum() > 20


def test_steps_determine_a_response():
    edges = step_image((40, 80)).edges
    # Kim et al. leave a family of answers if (dark side, range) are collinear.
    sides = np.array([sorted(e.before + e.after) for e in edges])
    cloud = np.stack([sides[:, 0], sides[:, 1] - sides[:, 0]], axis=1)
    assert np.linalg.svd(cloud - cloud.mean(axis=0), compute_uv=False)[1] > 0.1


def test_street_has_long_edges_between_colors_in_several_directions():
    edges = a_street(200, 0).edges
    lengths = [Edge(e.line.start, e.line.end).length for e in edges]
    angles = {round(Edge(e.line.start, e.line.end).orientation, 1) for e in edges}
    assert len(edges) > 20
    assert max(lengths) > 100
    assert len(angles) > 5
    steps = np.array([np.subtract(e.after, e.before) for e in edges])
    # A color edge whose channels step unlike each other.
    assert np.ptp(steps, axis=1).max() > 0.3


def test_street_looks_alike_at_every_size():
    small, large = (a_street(rows, 1).linear for rows in (100, 200))
    mean = large.reshape(100, 2, 150, 2, 3).mean(axis=(1, 3))
    houses = slice(30, 70), slice(45, 140)
    # Pixels that several sides cross are mixed in another order of coverage; few are.
    assert np.abs(small[houses] - mean[houses]).mean() < 0.01


def test_coverage_of_a_polygon_is_its_exact_area():
    triangle = np.array([(1.3, 2.1), (4.75, 9.2), (8.2, 3.6)])
    share = coverage([triangle], (10, 12))
    (r0, c0), (r1, c1), (r2, c2) = triangle
    area = abs((r1 - r0) * (c2 - c0) - (r2 - r0) * (c1 - c0)) / 2
    assert share.sum() == pytest.approx(area, rel=1e-6)
    assert share[4, 4] == 1
    assert share[0, 0] == 0


def test_coverage_agrees_with_supersampling():
    polygon = np.array([(-2.2, 3.0), (4.7, 14.1), (12.3, 6.4), (5.1, -3.3)])
    grid = (np.arange(10 * 64) + 0.5) / 64, (np.arange(12 * 64) + 0.5) / 64
    row, column = np.meshgrid(*grid, indexing="ij")
    inside = np.ones(row.shape, dtype=bool)
    for (r0, c0), (r1, c1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        inside &= (r1 - r0) * (column - c0) <= (c1 - c0) * (row - r0)
    sampled = inside.reshape(10, 64, 12, 64).mean(axis=(1, 3))
    # 64 x 64 samples of a pixel that a line crosses are right within 2 / 64.
    np.testing.assert_allclose(coverage([polygon], (10, 12)), sampled, atol=2 / 64)


def test_a_hole_is_left_out():
    outer = np.array([(1, 1), (1, 9), (8, 9), (8, 1)])
    hole = np.array([(2, 2), (5, 2), (5, 6), (2, 6)])
    share = coverage([outer, hole], (10, 11))
    assert share.sum() == pytest.approx(7 * 8 - 3 * 4)
    assert share[3, 3] == 0


def test_pixel_centers_lie_at_whole_numbers():
    canvas = np.zeros((5, 6), dtype=np.float32)
    paint(canvas, [[(0.5, 1.5), (0.5, 3.5), (2.5, 3.5), (2.5, 1.5)]], 1.0)
    assert canvas[1:3, 2:4].min() == 1
    assert canvas.sum() == 4


def test_opacity_mixes_with_what_is_behind():
    canvas = np.full((4, 5), 0.2, dtype=np.float32)
    paint(canvas, [[(-1, -1), (-1, 9), (9, 9), (9, -1)]], 1.0, opacity=0.25)
    np.testing.assert_allclose(canvas, 0.4)


def test_what_lies_outside_paints_nothing():
    canvas = np.zeros((4, 5), dtype=np.float32)
    paint(canvas, [[(10, 10), (10, 12), (12, 11)]], 1.0)
    assert not canvas.any()


def test_sides_of_an_edge_follow_its_normal():
    edge = edge_between((2, 3), (9, 6), inside=(5, 20), levels=(0.9, 0.1))
    backwards = edge_between((9, 6), (2, 3), inside=(5, 20), levels=(0.9, 0.1))
    assert (backwards.before, backwards.after) == (edge.before, edge.after)
    normal = Edge((2, 3), (9, 6)).normal
    towards = normal[0] * (5 - 2) + normal[1] * (20 - 3) > 0
    assert (edge.after if towards else edge.before) == (0.9,)


def test_only_the_clean_part_of_a_line_is_kept():
    linear = np.full((60, 80, 3), 0.2, dtype=np.float32)
    linear[:, 40:] = (0.3, 0.6, 0.2)
    linear[:20, 45:50] = 0.9  # a neighbor beside the upper third
    line = Line((0.0, 39.5), (59.0, 39.5))
    (edge,) = clean_edges(linear, [line], reach=8)
    rows = sorted((edge.line.start[0], edge.line.end[0]))
    assert rows[0] == pytest.approx(20, abs=4)  # stations are 2 pixels apart
    assert rows[1] == pytest.approx(59, abs=0.1)
    np.testing.assert_allclose(edge.after, (0.3, 0.6, 0.2), atol=1e-6)


def test_a_line_without_a_step_is_no_edge():
    linear = np.full((60, 80, 3), 0.2, dtype=np.float32)
    assert clean_edges(linear, [Line((5.0, 5.0), (50.0, 60.0))], reach=5) == []


@pytest.mark.parametrize(
    "make",
    [
        lambda: Scene(np.zeros((5, 6, 4))),
        lambda: Scene(np.full((5, 6), 1.2)),
        lambda: Scene(np.full((5, 6), np.nan)),
        lambda: slanted_edges((50, 60), channels=2),
    ],
)
def test_wrong_scenes_are_refused(make):
    with pytest.raises(ValueError, match="expected"):
        make()
