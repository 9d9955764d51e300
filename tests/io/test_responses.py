"""Responses in JSON files: the format, the way back, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import Finding, ResponseEstimate, ResponseStatus
from napari_crfdeblur.io import read_responses, write_responses
from napari_crfdeblur.io.responses import responses_content, responses_from
from napari_crfdeblur.response import SRGB, Emor, Gamma, Polynomial

INTENSITY = np.linspace(0, 1, 257)


def an_estimate(curve=None, status=ResponseStatus.DOUBTFUL):
    curve = curve or Polynomial((0.2, 0.1, 0.7))
    irradiance = curve.to_irradiance(INTENSITY)
    lower, upper = irradiance * 0.9, np.minimum(irradiance * 1.1, 1)
    figures = {"collinearity": 0.12}
    return ResponseEstimate(curve, INTENSITY, lower, upper, (0.13, 0.84), status, figures)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "response.json"


@pytest.fixture
def content(path):
    """A response file as text that can be changed."""
    write_responses(path, [an_estimate()])
    return json.loads(path.read_text(encoding="utf-8"))


def test_the_format_is_the_documented_one(content):
    assert {k: content[k] for k in ("format", "version", "direction")} == {
        "format": "crfdeblur-response",
        "version": 1,
        "direction": "inverse",
    }
    (channel,) = content["channels"]
    irradiance = an_estimate().curve.to_irradiance(INTENSITY)
    np.testing.assert_array_equal(channel["intensity"], INTENSITY)
    np.testing.assert_array_equal(channel["irradiance"], irradiance)
    np.testing.assert_array_equal(channel["lower"], irradiance * 0.9)
    np.testing.assert_array_equal(channel["upper"], np.minimum(irradiance * 1.1, 1))
    assert channel["name"] == "all"
    assert channel["covered"] == [0.13, 0.84]
    assert channel["status"] == "doubtful"


def test_a_file_says_why_a_response_is_in_doubt(path, content):
    assert content["channels"][0]["findings"] == []
    doubts = (Finding.NARROW, Finding.UNSURE)
    write_responses(path, [replace(an_estimate(), findings=doubts)])
    (channel,) = json.loads(path.read_text(encoding="utf-8"))["channels"]
    assert channel["findings"] == [
        {"name": "narrow", "message": Finding.NARROW.value},
        {"name": "unsure", "message": Finding.UNSURE.value},
    ]


@pytest.mark.parametrize("others", [{}, {"findings": None}, {"findings": [{"name": "new"}]}])
def test_a_response_is_read_whatever_its_findings(path, content, others):
    del content["channels"][0]["findings"]
    content["channels"][0] |= others
    path.write_text(json.dumps(content), encoding="utf-8")
    (back,) = read_responses(path)
    irradiance = an_estimate().curve.to_irradiance(INTENSITY)
    np.testing.assert_array_equal(back.to_irradiance(INTENSITY), irradiance)


def test_three_responses_are_named_by_their_channel(path):
    write_responses(path, [an_estimate(Gamma(g)) for g in (1.8, 2.0, 2.4)])
    channels = json.loads(path.read_text(encoding="utf-8"))["channels"]
    assert [channel["name"] for channel in channels] == ["R", "G", "B"]
    for exponent, curve in zip((1.8, 2.0, 2.4), read_responses(path), strict=True):
        np.testing.assert_array_equal(curve.to_irradiance(INTENSITY), INTENSITY**exponent)


@pytest.mark.parametrize("curve", [Gamma(2.2), SRGB(), Emor((0.3, -0.2)), Polynomial((0.4, 0.6))])
def test_a_response_comes_back(path, curve):
    write_responses(path, [an_estimate(curve)])
    (back,) = read_responses(path)
    levels = np.arange(256) / 255
    # Straight lines between 257 samples: less than a hundredth of an 8-bit level for curves
    # whose second derivative stays below 20.
    np.testing.assert_allclose(
        back.to_irradiance(levels), curve.to_irradiance(levels), atol=0.01 / 255
    )
    np.testing.assert_array_equal(back.to_irradiance(INTENSITY), curve.to_irradiance(INTENSITY))


def test_a_response_that_was_read_can_be_written_again(path):
    write_responses(path, [an_estimate()])
    first = path.read_bytes()
    write_responses(path, [an_estimate(read_responses(path)[0])])
    assert path.read_bytes() == first


def test_the_content_is_what_the_file_holds(content):
    assert responses_content([an_estimate()]) == content


def test_a_response_comes_back_from_the_content_alone():
    estimates = [an_estimate(Gamma(g)) for g in (1.8, 2.0, 2.4)]
    curves = responses_from(responses_content(estimates), "layer")
    for curve, estimate in zip(curves, estimates, strict=True):
        np.testing.assert_array_equal(
            curve.to_irradiance(INTENSITY), estimate.curve.to_irradiance(INTENSITY)
        )


@pytest.mark.parametrize("content", [None, [], "gamma", {}, {"format": "crfdeblur-edges"}])
def test_content_that_is_no_response_is_refused_where_it_was(content):
    with pytest.raises(CrfDeblurError, match="layer 7: not a response file"):
        responses_from(content, "layer 7")


def test_two_responses_are_no_photo(path):
    with pytest.raises(ValueError, match="1 or 3"):
        responses_content([an_estimate(), an_estimate()])
    with pytest.raises(ValueError, match="1 or 3"):
        write_responses(path, [an_estimate(), an_estimate()])
    assert not path.exists()


def edit(place, key, value):
    """Change one entry of a nested content."""

    def change(content):
        inner = content["channels"][0] if place else content
        if value is None:
            del inner[key]
        else:
            inner[key] = value

    return change


def falling(content):
    content["channels"][0]["irradiance"][9:11] = content["channels"][0]["irradiance"][10:8:-1]


def not_a_number(content):
    content["channels"][0]["irradiance"][5] = float("nan")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (edit(0, "format", None), "not a response file"),
        (edit(0, "format", "crfdeblur-edges"), "not a response file"),
        (edit(0, "version", 2), "update"),
        (edit(0, "version", None), "version None"),
        (edit(0, "direction", "forward"), "swap the two lists"),
        (edit(0, "direction", None), "direction"),
        (edit(0, "channels", None), "1 or 3 channels"),
        (edit(0, "channels", []), "1 or 3 channels"),
        (edit(0, "channels", [1, 2]), "1 or 3 channels"),
        (edit(0, "channels", {"R": 1}), "1 or 3 channels"),
        (edit(0, "channels", [None]), "lacks its lists"),
        (edit(0, "channels", ["intensity"]), "lacks its lists"),
        (edit(1, "intensity", None), "lacks its lists"),
        (edit(1, "irradiance", None), "lacks its lists"),
        (edit(1, "irradiance", "0 1"), "lacks its lists"),
        (edit(1, "irradiance", [0, [1]]), "lacks its lists"),
        (edit(1, "irradiance", {"a": 1}), "lacks its lists"),
        (edit(1, "irradiance", []), "increase strictly"),
        (edit(1, "irradiance", 1.0), "lacks its lists"),
        (edit(1, "irradiance", [0, 0.5, 1]), "increase strictly"),
        (edit(1, "irradiance", [[0, 1], [0, 1]]), "lacks its lists"),
        (edit(1, "intensity", np.linspace(0, 0.9, 257).tolist()), "increase strictly"),
        (edit(1, "intensity", np.linspace(0, 255, 257).tolist()), "increase strictly"),
        (falling, "increase strictly"),
        (not_a_number, "NaN is no number"),
    ],
)
def test_a_file_that_is_no_response_is_refused_in_words(path, content, change, reason):
    change(content)
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(CrfDeblurError, match=rf"response\.json: .*{reason}"):
        read_responses(path)


@pytest.mark.parametrize(
    "raw",
    [
        b"",
        b"gamma 2.2",
        b'{"format": "crfdeblur-response"',
        b"\xff\xfe\x00",
        b"[]",
        b"[" * 100_000,
        b"[" + b"9" * 5000 + b"]",
    ],
)
def test_what_is_no_json_object_is_refused(path, raw):
    path.write_bytes(raw)
    with pytest.raises(CrfDeblurError, match=r"response\.json: not a"):
        read_responses(path)


def test_other_suffix_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(CrfDeblurError, match=r"ends in \.json"):
        write_responses(tmp_path / "response.txt", [an_estimate()])
    assert list(tmp_path.iterdir()) == []


def test_missing_response_is_refused(path):
    with pytest.raises(CrfDeblurError, match="no such file"):
        read_responses(path)
