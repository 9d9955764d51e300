"""Reports: what they show and say, and that the files are whole and self-contained."""

import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from base64 import b64decode
from dataclasses import replace
from html.parser import HTMLParser

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image as Pillow

from napari_crfdeblur.edges import Edge, EdgeStatus
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import ResponseEstimate, ResponseStatus
from napari_crfdeblur.photo import from_unit
from napari_crfdeblur.profiles import ProfileGroup, ProfileSource
from napari_crfdeblur.psf import PsfEstimate, PsfStatus, as_psf
from napari_crfdeblur.report import (
    Report,
    draw_edges,
    draw_photo,
    draw_profiles,
    draw_psf,
    draw_response,
    write_report,
)
from napari_crfdeblur.report.content import figure_table, normalized, sentences, spread
from napari_crfdeblur.report.pictures import detail, reduced
from napari_crfdeblur.response import Gamma

CURVE = Gamma(2.0)
TITLE = "street & <corner>.jpg, $5"


def a_photo(shape=(160, 330, 3), dtype=np.uint8):
    return from_unit(np.random.default_rng(4).random(shape), dtype)


def a_group(channels=1):
    """Profiles of one shape in linear light, recorded by the curve; edges 0, 1, 2."""
    position = np.linspace(-6, 6, 31)
    shape = (1 + np.tanh(position / 2) / np.tanh(3)) / 2
    low, high = np.array([[0.001, 0.4, 0.02], [0.6, 0.9, 0.8]])
    light = np.repeat(low[:, None] + (high - low)[:, None] * shape, channels, axis=0)
    recorded = CURVE.to_intensity(light)
    sources = [ProfileSource(0, e, c) for e in range(3) for c in range(channels)]
    ones = np.ones_like(light)
    return ProfileGroup(
        position,
        recorded,
        ones,
        ones,
        recorded[:, [0, -1]],
        ones[:, :2],
        0.0,
        1,
        tuple(sources),
    )


EDGES = (
    Edge((10, 20), (60, 20), 1, 11.0, 0.2),
    Edge((70, 50), (120, 50), 1, 12.0, 0.3),
    Edge((70, 80), (120, 80), -1, 13.0, 0.3),
    Edge((90, 100), (95, 180), 1, 13.0, 0.3),
    Edge((20, 100), (25, 180), 1, 13.0, 0.3, EdgeStatus.CLIPPED),
    Edge((30, 100), (35, 180), 1, 13.0, 0.3, EdgeStatus.CLIPPED),
    Edge((40, 200), (45, 280), 1, 13.0, 0.3, EdgeStatus.SHORT),
)


def an_estimate(status=ResponseStatus.DOUBTFUL):
    intensity = np.linspace(0, 1, 257)
    band = intensity**2.1, intensity**1.9
    return ResponseEstimate(CURVE, intensity, *band, (0.3, 0.9), status, {"collinearity": 0.123})


def a_report(**parts):
    psf = as_psf(np.random.default_rng(1).random((7, 11)))
    whole = {
        "title": TITLE,
        "photo": a_photo(),
        "edges": EDGES,
        "groups": [a_group()],
        "responses": [an_estimate()],
        "psf": PsfEstimate(psf, PsfStatus.DOUBTFUL, {"flatness": 0.5}),
        "sharp": a_photo(),
        "notes": ["A <note>."],
    }
    return Report(**(whole | parts))


PARTS = {
    "all": a_report(),
    "gray, 16 bits": a_report(
        photo=a_photo((170, 310), np.uint16), sharp=a_photo((170, 310), np.uint16)
    ),
    "float with alpha": a_report(photo=a_photo((170, 310, 4), np.float32), sharp=None),
    "per channel": a_report(groups=[a_group(3)], responses=[an_estimate()] * 3),
    "no PSF": a_report(psf=None, sharp=None),
    "given": a_report(edges=(), groups=(), responses=[an_estimate(ResponseStatus.GIVEN)]),
    "portrait": a_report(photo=a_photo((330, 60)), sharp=a_photo((330, 60))),
    "tiny": a_report(photo=a_photo((8, 9)), sharp=a_photo((8, 9)), edges=EDGES[:1]),
    "further pictures": a_report(pictures={"Truth": a_photo((50, 90))}),
    "only a response": Report(TITLE, responses=[an_estimate()]),
    "only a photo": Report(TITLE, a_photo()),
    "nothing": Report(TITLE),
}


@pytest.mark.parametrize("parts", PARTS)
def test_png_is_one_picture_whatever_is_missing(tmp_path, parts):
    write_report(tmp_path / "report.png", PARTS[parts])
    with Pillow.open(tmp_path / "report.png") as picture:
        assert picture.width == 1654  # A4 at 200 dpi
        picture.load()


class Markup(HTMLParser):
    """Checks that tags are balanced; keeps the text, the names of tags and the pictures."""

    EMPTY = ("meta", "img", "br")

    def __init__(self):
        super().__init__()
        self.open, self.names, self.text, self.pictures = [], [], "", []

    def handle_starttag(self, tag, attributes):
        self.names.append(tag)
        if tag not in self.EMPTY:
            self.open.append(tag)
        if tag == "img":
            self.pictures.append(dict(attributes))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data if self.open[-1:] != ["style"] else ""


def parsed(path):
    markup = Markup()
    markup.feed(path.read_text(encoding="utf-8"))
    markup.close()
    assert markup.open == []
    return markup


@pytest.mark.parametrize("parts", PARTS)
def test_html_is_balanced_escaped_and_self_contained(tmp_path, parts):
    path = tmp_path / "report.html"
    write_report(path, PARTS[parts])
    markup = parsed(path)
    assert TITLE in markup.text
    assert "corner" not in markup.names
    for picture in markup.pictures:
        assert picture["alt"]
        kind, data = re.fullmatch(r"data:image/([\w+]+);base64,(.+)", picture["src"]).groups()
        content = b64decode(data, validate=True)
        if kind == "png":
            assert content.startswith(b"\x89PNG")
        else:
            assert ElementTree.fromstring(content).tag.endswith("svg")
    assert "http" not in path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def markup(tmp_path_factory):
    """That of a report of all parts."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(path, a_report())
    return parsed(path)


def test_html_says_how_far_the_results_can_be_trusted(markup):
    text = markup.text
    for said in (ResponseStatus.DOUBTFUL.value, PsfStatus.DOUBTFUL.value, "A <note>."):
        assert said in text
    assert f"2 rejected: {EdgeStatus.CLIPPED.value}" in text
    assert f"1 rejected: {EdgeStatus.SHORT.value}" in text


def test_every_stage_has_its_panel(markup):
    assert [p["alt"] for p in markup.pictures] == [
        "Edges",
        "Profiles as recorded",
        "Profiles linearized",
        "Inverse response",
        "Photo",
        "Deblurred",
        "Point spread function",
        "Detail of the photo",
        "Detail, deblurred",
    ]


def test_detail_shows_where_deblurring_changed_most():
    photo = np.full((300, 700), 0.5, dtype=np.float32)
    sharp = photo.copy()
    sharp[200:240, 500:540] = 0.9
    rows, columns = detail(photo, sharp)
    assert (rows.start <= 200) & (rows.stop >= 240)
    assert (columns.start <= 500) & (columns.stop >= 540)


def test_channels_of_different_status_are_named():
    good, doubtful = an_estimate(ResponseStatus.GOOD), an_estimate()
    said = sentences(a_report(responses=[good, doubtful, good]))
    assert said["Response (red, blue)"].startswith(ResponseStatus.GOOD.value)
    assert said["Response (green)"].startswith(ResponseStatus.DOUBTFUL.value)


def test_the_table_counts_and_measures():
    rows = figure_table(a_report(figures={"time": "3 s"}))
    assert rows["photo"] == "330 x 160 px, uint8"
    assert rows["edges"] == "4 good, 3 rejected"
    assert rows["profiles"] == "3 in 1 group"
    assert rows["covered intensity"] == "0.30-0.90"
    assert rows["response, collinearity"] == "0.123"
    assert rows["PSF"] == "11 x 7 px"
    assert rows["time"] == "3 s"


@pytest.mark.parametrize("curves", [[CURVE], [CURVE] * 3])
def test_profiles_fall_on_one_another_once_the_response_is_undone(curves):
    group = a_group(len(curves))
    assert spread(group) > 0.02
    assert spread(group, curves) < 1e-12  # rounding
    profiles = normalized(group, curves)
    np.testing.assert_allclose(profiles[:, [0, -1]] - [0, 1], 0, atol=1e-12)


def test_edges_of_one_group_have_one_color_and_reasons_are_counted():
    ax = Figure().add_subplot()
    draw_edges(ax, EDGES, [a_group()])
    handles, labels = ax.get_legend_handles_labels()
    assert labels[:2] == ["3 at 90°", "1 at other angles"]
    assert labels[2].startswith("2 rejected")
    assert [len(handle.get_segments()) for handle in handles] == [3, 1, 2, 1]
    np.testing.assert_array_equal(handles[0].get_segments()[0], [[20, 10], [20, 60]])


def test_edges_without_groups_are_drawn_all_the_same():
    ax = Figure().add_subplot()
    draw_edges(ax, EDGES)
    assert ax.get_legend_handles_labels()[1][0] == "4 found"


def test_edges_of_other_photos_are_not_drawn_on_the_first():
    group = a_group()
    elsewhere = tuple(ProfileSource(1, s.edge, 0) for s in group.sources)
    ax = Figure().add_subplot()
    draw_edges(ax, EDGES, [replace(group, sources=elsewhere)])
    assert ax.get_legend_handles_labels()[1][0] == "4 at other angles"


def test_response_is_drawn_beside_gamma_with_its_band():
    ax = Figure().add_subplot()
    draw_response(ax, [an_estimate()])
    labels = ax.get_legend_handles_labels()[1]
    assert {"gamma 2.2", "sRGB", "estimate", "95 % band", "covered by edges"} == set(labels)
    line = next(line for line in ax.lines if line.get_label() == "estimate")
    np.testing.assert_allclose(line.get_ydata(), CURVE.to_irradiance(line.get_xdata()))


def test_every_drawing_fits_on_axes_of_any_figure():
    figure = Figure()
    axes = figure.subplots(1, 5)
    draw_photo(axes[0], a_photo())
    draw_profiles(axes[1], a_group())
    draw_profiles(axes[2], a_group(), [CURVE])
    draw_response(axes[3], [an_estimate()] * 3, {"truth": CURVE})
    draw_psf(axes[4], a_report().psf.psf)
    figure.canvas.draw()


def test_a_large_photo_is_reduced_by_the_means_of_blocks():
    photo = a_photo((503, 1207), np.uint16)
    small, k = reduced(photo, 300)
    assert (k, small.shape) == (5, (100, 241))
    blocks = photo[:500, :1205].reshape(100, 5, 241, 5).mean(axis=(1, 3)) / 65535
    np.testing.assert_allclose(small, blocks, atol=1e-6)  # float32 sums of 25


def test_axes_of_a_reduced_photo_count_its_full_pixels():
    ax = Figure().add_subplot()
    draw_photo(ax, a_photo((30, 2503)))
    assert ax.get_xlim() == (-0.5, 2502.5)
    assert ax.get_ylim() == (29.5, -0.5)
    assert ax.images[0].get_array().shape[1] <= 1000


def test_reporting_leaves_the_settings_of_matplotlib_alone(tmp_path):
    before = dict(matplotlib.rcParams)
    write_report(tmp_path / "report.png", PARTS["only a response"])
    assert dict(matplotlib.rcParams) == before


def test_a_report_needs_no_pyplot_and_the_package_no_matplotlib_to_load(tmp_path):
    code = f"""
import sys
from pathlib import Path
from napari_crfdeblur.report import Report, write_report
assert "matplotlib" not in sys.modules
write_report(Path({str(tmp_path / "a.html")!r}), Report("a"))
write_report(Path({str(tmp_path / "a.png")!r}), Report("a"))
assert "matplotlib.pyplot" not in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_other_suffix_is_refused(tmp_path):
    with pytest.raises(CrfDeblurError, match=r"ends in \.html, \.png"):
        write_report(tmp_path / "report.pdf", PARTS["nothing"])


@pytest.mark.parametrize("suffix", [".html", ".png"])
def test_a_report_that_fails_leaves_the_old_one(tmp_path, suffix):
    path = tmp_path / f"report{suffix}"
    path.write_bytes(b"old")
    with pytest.raises(ValueError, match="PSF"):
        write_report(path, a_report(figures=Broken()))
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


class Broken(dict):
    """Figures that cannot be read."""

    def __iter__(self):
        raise ValueError("the PSF is gone")

    keys = __iter__


def test_the_legend_names_the_commonest_reasons_and_counts_the_rest():
    statuses = [status for status in EdgeStatus if status is not EdgeStatus.GOOD]
    edges = [
        Edge((0.0, float(n)), (9.0, float(n)), status=status)
        for number, status in enumerate(statuses)
        for n in range(len(statuses) - number)
    ]
    ax = Figure().add_subplot()
    draw_edges(ax, edges)
    labels = [collection.get_label() for collection in ax.collections]
    assert len(labels) == 5
    assert statuses[0].value in labels[0]
    rest = sum(len(statuses) - number for number in range(4, len(statuses)))
    assert labels[-1] == f"{rest} rejected for other reasons"
