from math import cos, hypot, pi, radians, sin

import numpy as np
import pytest
from turned_rectangles import Rectangle, blurred_step, crossing, photograph, to_kind

from napari_crfdeblur.edges import (
    Line,
    estimate_blur_extent,
    find_edges,
    refine_edges,
)
from napari_crfdeblur.edges import Rectangle as Drawn

ORIENTATIONS = np.radians([0, 0.4, 7, 31, 45, 60, 88, 89.6])


def one_rectangle(extent, angle, *, inside=0.6, outside=0.15, gamma=2.2, noise=0.01):
    size = 3.5 * extent + 40
    shape = (round(2 * size + 10), round(2.3 * size))
    center = (shape[0] / 2 + 0.3, shape[1] / 2 - 0.4)
    rectangle = Rectangle(center, (0.5 * size, 0.6 * size), angle, (inside,))
    photo = photograph(shape, (outside,), [rectangle], extent, gamma=gamma, noise=noise)
    return photo, rectangle


def errors(edge, rectangle, extent, outside, gamma=2.2):
    """Distance (pixels) and angle (radians) of an edge from the nearest true side."""

    def apart(side):
        return hypot(*(np.add(edge.start, edge.end) / 2 - side[0]))

    middle, angle, _ = min(rectangle.sides, key=apart)
    normal = (sin(angle), cos(angle))
    shift = crossing(rectangle.light[0], outside, angle, extent, gamma)
    ends = [(np.array(p) - middle) @ normal - shift for p in (edge.start, edge.end)]
    turn = (edge.orientation - angle + pi / 2) % pi - pi / 2
    return max(map(abs, ends)), abs(turn)


@pytest.mark.parametrize("extent", [5, 20, 60])
def test_finds_the_four_sides_of_a_rectangle_to_a_fraction_of_a_pixel(extent):
    photo, rectangle = one_rectangle(extent, 0.3)
    good = [e for e in find_edges(photo, blur_extent=extent) if e.good]
    assert len(good) == 4
    for edge in good:
        # A third of a pixel, more where the transition is so wide that noise moves its middle.
        distance, turn = errors(edge, rectangle, extent, 0.15)
        assert distance < max(0.3, 0.01 * extent)
        assert turn < radians(0.3)


@pytest.mark.parametrize("angle", ORIENTATIONS)
def test_finds_edges_of_every_orientation(angle):
    photo, rectangle = one_rectangle(12, angle)
    good = [e for e in find_edges(photo, blur_extent=12) if e.good]
    assert len(good) == 4
    assert max(errors(e, rectangle, 12, 0.15)[0] for e in good) < 0.3


@pytest.mark.parametrize("angle", ORIENTATIONS)
@pytest.mark.parametrize("levels", [(0.6, 0.15), (0.15, 0.6)])
def test_polarity_says_whether_intensity_rises_along_the_normal(angle, levels):
    photo, rectangle = one_rectangle(12, angle, inside=levels[0], outside=levels[1])
    for edge in find_edges(photo, blur_extent=12):
        outward = np.add(edge.start, edge.end) / 2 - rectangle.center
        brighter_outside = levels[1] > levels[0]
        along_normal = outward @ edge.normal > 0
        assert edge.polarity == (1 if brighter_outside == along_normal else -1)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, np.float32, np.float64])
def test_any_kind_of_number_gives_the_same_edges(dtype):
    photo, _ = one_rectangle(12, 0.3)
    expected = find_edges(photo, blur_extent=12)
    found = find_edges(to_kind(photo, dtype), blur_extent=12)
    assert [e.status for e in found] == [e.status for e in expected]
    # Rounding to 8 bits moves an edge by far less than a tenth of a pixel.
    assert np.allclose([e.normal for e in found], [e.normal for e in expected], atol=1e-3)


def test_an_edge_between_colors_of_one_brightness_is_found():
    light = ((0.6, 0.2, 0.2), (0.2, 0.6, 0.2))
    rectangle = Rectangle((70.2, 90.4), (40, 50), 0.4, light[0])
    photo = photograph((140, 180), light[1], [rectangle], 10, noise=0.01)
    alpha = np.concatenate([photo, np.ones((140, 180, 1))], axis=2)
    assert sum(e.good for e in find_edges(photo, blur_extent=10)) == 4
    assert find_edges(alpha, blur_extent=10) == find_edges(photo, blur_extent=10)


def test_contrast_and_width_are_those_of_the_transition():
    photo, _ = one_rectangle(30, 0.0, noise=0.002)
    across = next(e for e in find_edges(photo, blur_extent=30) if sin(e.orientation) < 0.1)
    assert across.contrast == pytest.approx(0.6 ** (1 / 2.2) - 0.15 ** (1 / 2.2), abs=0.01)
    d = np.linspace(-30, 30, 6001)
    share = blurred_step(d, 0.0, 30)
    true = np.ptp(d[(share > 0.005) & (share < 0.995)])
    assert across.width == pytest.approx(true, abs=4)  # the flat sides begin gradually


def test_the_same_photo_gives_the_same_edges():
    photo, _ = one_rectangle(12, 0.3, noise=0.02)
    assert find_edges(photo, blur_extent=12) == find_edges(photo, blur_extent=12)


def test_no_edge_is_reported_twice():
    photo, _ = one_rectangle(8, 0.3)
    edges = find_edges(photo, blur_extent=16)
    assert len(edges) == 4


def test_a_photo_without_edges_gives_none():
    noise = 0.5 + 0.01 * np.random.default_rng(3).standard_normal((90, 130))
    assert find_edges(noise, blur_extent=10) == ()
    assert find_edges(np.full((40, 60), 0.4), blur_extent=10) == ()
    assert find_edges(np.full((9, 12, 3), 7, dtype=np.uint8), blur_extent=60) == ()


def test_a_busy_picture_has_no_good_edge():
    rng = np.random.default_rng(5)
    busy = np.kron(rng.uniform(size=(40, 55)), np.ones((3, 3)))
    assert not any(e.good for e in find_edges(busy, blur_extent=12))


def test_good_edges_come_first_and_the_longest_of_them():
    photo, _ = one_rectangle(12, 0.3)
    photo[:30] = np.random.default_rng(1).uniform(size=photo[:30].shape)
    edges = find_edges(photo, blur_extent=12)
    assert [e.good for e in edges] == sorted((e.good for e in edges), reverse=True)
    lengths = [e.length for e in edges if e.good]
    assert lengths == sorted(lengths, reverse=True)


def widest_transition(rectangle, extent):
    """Distance from .5 to 99.5 percent, across the side where it is largest."""
    d = np.linspace(-extent, extent, 4001)
    shares = [blurred_step(d, angle, extent) for _, angle, _ in rectangle.sides]
    return max(np.ptp(d[(s > 0.005) & (s < 0.995)]) for s in shares)


@pytest.mark.parametrize("extent", [5, 10, 20, 40, 60])
def test_the_extent_of_the_blur_is_guessed_from_the_photo(extent):
    photo, rectangle = one_rectangle(extent, 0.2, noise=0.005)
    true = widest_transition(rectangle, extent)
    assert 0.8 * true < estimate_blur_extent(photo) < 1.5 * true


@pytest.mark.parametrize(("extent", "center"), [(6, (650, 850)), (30, (300, 400))])
def test_the_extent_is_guessed_in_a_large_photo(extent, center):
    rectangle = Rectangle(center, (170, 230), 0.2, (0.6,))
    photo = photograph((1300, 1700), (0.15,), [rectangle], extent, noise=0.005)
    true = widest_transition(rectangle, extent)
    # On a reduced photo a width is known to whole reduced pixels only.
    assert 0.8 * true < estimate_blur_extent(photo.astype(np.float32)) < 1.7 * true


def test_edges_that_are_soft_by_themselves_do_not_widen_the_extent():
    sharp, rectangle = one_rectangle(9, 0.2, noise=0.005)
    soft, _ = one_rectangle(35, 0.2, noise=0.005)
    rows = len(soft)
    sharp = np.pad(sharp, [(0, rows - len(sharp)), (0, 0)], mode="edge")
    # Most edges are sharp but for the blur, and all areas beside them are alike.
    photo = np.concatenate([sharp, soft, sharp, sharp, sharp], axis=1)
    true = widest_transition(rectangle, 9)
    assert 0.8 * true < estimate_blur_extent(photo) < 1.5 * true


def test_a_photo_without_edges_still_gets_an_extent():
    assert estimate_blur_extent(np.full((40, 60), 0.5)) > 0


@pytest.mark.parametrize("extent", [6, 20])
def test_a_roughly_drawn_line_is_moved_onto_the_edge(extent):
    photo, rectangle = one_rectangle(extent, 0.3)
    lines = []
    for middle, angle, length in rectangle.sides:
        off = 0.3 * extent  # beside the edge, and 3 degrees askew
        along = np.array([-cos(angle + 0.05), sin(angle + 0.05)]) * length * 0.35
        start = middle + off * np.array([sin(angle), cos(angle)])
        lines.append(Line(tuple(start - along), tuple(start + along)))
    edges = refine_edges(photo, lines, blur_extent=extent)
    assert all(e.good for e in edges)
    for edge, (middle, *_) in zip(edges, rectangle.sides, strict=True):
        assert hypot(*(np.add(edge.start, edge.end) / 2 - middle)) < extent
        assert errors(edge, rectangle, extent, 0.15)[0] < 0.3


@pytest.mark.parametrize("turn", [0, 1])
def test_a_rectangle_drawn_over_an_edge_tells_which_way_it_runs(turn):
    photo, rectangle = one_rectangle(12, 0.3)
    middle, angle, _ = list(rectangle.sides)[turn]
    normal = np.array([sin(angle), cos(angle)])
    along = np.array([-cos(angle), sin(angle)])
    # Longer across than along: the image, not the shape, says how the edge runs.
    corners = [
        tuple(middle + a * 15 * along + d * 18 * normal)
        for a, d in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    (edge,) = refine_edges(photo, [Drawn(tuple(corners))], blur_extent=12)
    assert edge.good
    assert errors(edge, rectangle, 12, 0.15)[0] < 0.4


@pytest.mark.parametrize("extent", [0, -3, float("nan"), float("inf")])
def test_an_extent_that_is_not_a_positive_number_is_refused(extent):
    with pytest.raises(ValueError, match="positive blur extent"):
        find_edges(np.zeros((20, 20)), blur_extent=extent)
    with pytest.raises(ValueError, match="positive blur extent"):
        refine_edges(np.zeros((20, 20)), [], blur_extent=extent)
