"""Every reason for which an edge is rejected, in a picture made for it."""

import numpy as np
import pytest
from scipy.special import ndtr

from napari_crfdeblur.edges import EdgeStatus, Line, find_edges, refine_edges

SHAPE = (121, 161)
ROW, COLUMN = np.indices(SHAPE)
MIDDLE = 80.3
EXTENT = 12
DRAWN = Line((20.0, 80.0), (100.0, 80.0))


def step(at=MIDDLE, sigma=2.0):
    """A blurred vertical step from 0 to 1, crossing its middle at column `at`."""
    return ndtr((COLUMN - at) / sigma)


def photo(share, dark=0.2, bright=0.7, noise=0.004):
    noise = noise * np.random.default_rng(0).standard_normal(share.shape)
    return np.clip(dark + (bright - dark) * share + noise, 0, 1)


def status(image, line=DRAWN):
    return refine_edges(image, [line], blur_extent=EXTENT)[0].status


def test_a_blurred_step_is_good():
    assert status(photo(step())) is EdgeStatus.GOOD


@pytest.mark.parametrize("column", [3.0, 157.0])
def test_an_edge_at_the_border_is_outside(column):
    line = Line((20.0, column), (100.0, column))
    assert status(photo(step(column)), line) is EdgeStatus.OUTSIDE


def test_a_line_beyond_the_image_is_outside():
    line = Line((20.0, 400.0), (100.0, 400.0))
    assert status(photo(step()), line) is EdgeStatus.OUTSIDE


def test_a_stub_is_short():
    assert status(photo(step()), Line((60.0, 80.0), (67.0, 80.0))) is EdgeStatus.SHORT


def test_a_step_lost_in_noise_is_faint():
    assert status(photo(step(), dark=0.4, bright=0.41)) is EdgeStatus.FAINT


def test_a_flat_area_is_faint():
    assert status(photo(step(), dark=0.4, bright=0.4)) is EdgeStatus.FAINT


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("levels", [(0.3, 1.1), (-0.1, 0.6), (0.3, 1.0), (0.0, 0.6)])
def test_a_side_at_the_end_of_the_range_is_clipped(levels, noise):
    image = photo(step(), *levels, noise=noise)
    assert status(image) is EdgeStatus.CLIPPED
    assert status(np.rint(image * 255).astype(np.uint8)) is EdgeStatus.CLIPPED


def test_an_edge_clipped_in_one_channel_is_good():
    channels = [photo(step(), 0.2, bright) for bright in (1.1, 0.7, 0.6)]
    assert status(np.stack(channels, axis=-1)) is EdgeStatus.GOOD


def test_a_slope_beside_the_edge_is_uneven():
    ramp = np.clip(COLUMN - MIDDLE, 0, None) * 0.02
    assert status(photo(step() + ramp, bright=0.5)) is EdgeStatus.UNEVEN_SIDE


def test_texture_beside_the_edge_is_uneven():
    blotches = 0.15 * np.sin(ROW / 2.5) * (COLUMN > MIDDLE)
    assert status(photo(step() + blotches)) is EdgeStatus.UNEVEN_SIDE


@pytest.mark.parametrize("overshoot", [0.08, 0.15])
def test_a_sharpened_edge_is_not_monotone(overshoot):
    bump = overshoot * np.exp(-(((COLUMN - MIDDLE - 6) / 2) ** 2))
    assert status(photo(step() + bump)) is EdgeStatus.NOT_MONOTONE


def test_an_arc_is_curved():
    at = MIDDLE + 3 * np.sin(ROW / 6)
    assert status(photo(ndtr((COLUMN - at) / 2))) is EdgeStatus.CURVED


def test_an_edge_whose_blur_changes_varies():
    sigma = np.where(ROW // 6 % 2 == 0, 0.8, 3.0)
    assert status(photo(ndtr((COLUMN - MIDDLE) / sigma))) is EdgeStatus.VARIES


def test_misregistered_channels_disagree():
    channels = [photo(step(MIDDLE + shift)) for shift in (-2, 0, 2)]
    assert status(np.stack(channels, axis=-1)) is EdgeStatus.CHANNELS_DISAGREE


@pytest.mark.parametrize("gamma", [1.0, 2.2])
def test_a_response_does_not_make_channels_disagree(gamma):
    levels = [(0.02, 0.9), (0.6, 0.3), (0.3, 0.32)]
    channels = [photo(step(sigma=4), *pair, noise=0) ** (1 / gamma) for pair in levels]
    line = refine_edges(np.stack(channels, axis=-1), [DRAWN], blur_extent=26)
    assert line[0].good


def test_a_bad_edge_keeps_its_place_in_the_answer():
    lines = [Line((20.0, 20.0), (100.0, 20.0)), DRAWN]
    flat, good = refine_edges(photo(step()), lines, blur_extent=EXTENT)
    assert (flat.status, good.status) == (EdgeStatus.FAINT, EdgeStatus.GOOD)
    assert np.allclose([flat.start[1], flat.end[1]], 20, atol=EXTENT)


def test_an_edge_is_trimmed_to_the_part_that_is_good():
    image = photo(step())
    image[70:] = np.random.default_rng(2).uniform(size=image[70:].shape)
    (edge,) = refine_edges(image, [DRAWN], blur_extent=EXTENT)
    assert edge.good
    assert max(edge.start[0], edge.end[0]) < 70
    assert edge.length > 35


def test_a_gap_leaves_both_parts():
    image = photo(step())
    image[50:70] = np.random.default_rng(2).uniform(size=image[50:70].shape)
    good = [e for e in find_edges(image, blur_extent=EXTENT) if e.good]
    rows = sorted((e.start[0] + e.end[0]) / 2 for e in good)
    assert len(rows) == 2
    assert rows[0] < 50 < 70 < rows[1]
