"""JSON that others have written: a value that makes sense, or one sentence, and nothing else."""

import json
from dataclasses import replace
from math import isfinite

import numpy as np
import pytest
from hostile import NO_JSON, documents, flipped, places, read_or_refused, truncated, with_value
from test_cameras import KEY, RECORD
from test_records import OBJECTS, PRIOR
from test_responses import an_estimate

from napari_crfdeblur.batch.journal import NAME, Journal
from napari_crfdeblur.edges import Line, Rectangle
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import (
    CameraRecord,
    camera_file,
    from_record,
    read_camera,
    read_edges,
    read_responses,
    stored_cameras,
    to_record,
    write_camera,
    write_responses,
)
from napari_crfdeblur.io.json_files import parse_json, read_json
from napari_crfdeblur.io.limits import Limits
from napari_crfdeblur.response import Tabulated

EDGES = {
    "format": "crfdeblur-edges",
    "version": 1,
    "edges": [
        {"start": [1, 2], "end": [30, 4], "status": "good"},
        {"corners": [[1, 2], [3, 9], [8, 7], [6, 0.5]]},
    ],
}


def response_document(path):
    write_responses(path, [an_estimate()])
    return json.loads(path.read_text(encoding="utf-8"))


def is_response(found):
    return all(
        isinstance(each, Tabulated) and bool(np.isfinite(each.irradiance).all()) for each in found
    )


def is_edges(found):
    points = [
        point
        for each in found
        for point in (each.corners if isinstance(each, Rectangle) else (each.start, each.end))
    ]
    return all(isinstance(each, Line | Rectangle) for each in found) and all(
        isfinite(value) for point in points for value in point
    )


def is_camera(found):
    return found is None or (
        isinstance(found, CameraRecord)
        and found.key == KEY
        and bool(np.isfinite(found.posterior.mean).all())
    )


@pytest.fixture(params=["response", "edges", "camera"])
def kind(request, tmp_path):
    """A JSON file of a kind: its path, what it holds, how it is read, and what it may mean."""
    if request.param == "response":
        path = tmp_path / "a.json"
        return path, response_document(path), read_responses, is_response
    if request.param == "edges":
        path = tmp_path / "a.json"
        path.write_text(json.dumps(EDGES), encoding="utf-8")
        return path, EDGES, read_edges, is_edges
    few = replace(RECORD, posterior=PRIOR)
    write_camera(tmp_path, few)
    path = camera_file(tmp_path, KEY)
    document = json.loads(path.read_text(encoding="utf-8"))
    return path, document, lambda path: read_camera(path.parent, KEY), is_camera


def test_wrong_values_at_every_place_are_refused_or_make_sense(kind):
    path, document, read, is_right = kind
    refused = 0
    for text in documents(document, np.random.default_rng(11), 90):
        path.write_text(text, encoding="utf-8")
        found = read_or_refused(read, path)
        assert found is None or is_right(found), text[:300]
        refused += found is None
    assert refused > 30


def test_what_is_no_json_is_refused(kind):
    path, _, read, _ = kind
    for content in NO_JSON:
        path.write_bytes(content)
        assert read_or_refused(read, path) is None, content[:50]


def test_damaged_text_is_refused_or_makes_sense(kind):
    path, _, read, is_right = kind
    rng, whole = np.random.default_rng(12), path.read_bytes()
    for content in (*truncated(whole, rng, 15), *flipped(whole, rng, 25)):
        path.write_bytes(content)
        found = read_or_refused(read, path)
        assert found is None or is_right(found)


def test_damaged_cameras_are_passed_over_in_their_folder(tmp_path):
    for number, content in enumerate(NO_JSON):
        (tmp_path / f"{number}.json").write_bytes(content)
    write_camera(tmp_path, RECORD)
    assert [each.key for each in stored_cameras(tmp_path)] == [KEY]


@pytest.mark.parametrize("value", OBJECTS, ids=lambda value: type(value).__name__)
def test_a_damaged_record_is_an_object_or_one_sentence(value):
    rng = np.random.default_rng(13)
    record = json.loads(json.dumps(to_record(value)))
    for text in documents(record, rng, 15):
        try:
            from_record(json.loads(text))
        except CrfDeblurError as error:
            said = str(error)
        else:
            continue
        assert said.isprintable()
        assert len(said) < 700


@pytest.mark.parametrize(
    "record",
    [
        {"type": "Gamma", "exponent": 2.0, "other": 1},
        {"type": "ResponseStatus", "name": "GOOD", "other": 1},
        {"type": "float", "value": "1e5"},
        {"type": "float", "value": "inf", "other": 1},
        {"type": "dict", "items": [1]},
        {"type": "array", "dtype": "float64", "shape": [2], "data": [1, None]},
        {"type": "array", "dtype": "float64", "shape": [2], "data": [1, {}]},
        {"type": "array", "dtype": "float64", "shape": [10**12, 10**12], "data": [1]},
        {"type": "array", "dtype": "float64", "shape": [-1, 0], "data": []},
        {"type": "array", "dtype": "object", "shape": [1], "data": [1]},
        {"type": "array", "dtype": "(9999999,)f8", "shape": [1], "data": [1]},
        {"type": "array", "dtype": ["a", "f8"], "shape": [1], "data": [1]},
        {"type": "array", "dtype": "uint8", "shape": [1], "data": [300]},
        {"type": "array", "dtype": "uint8", "shape": [1], "data": [2.5]},
        {"type": "array", "dtype": "float32", "shape": [1], "data": [1e300]},
        {"type": "array", "dtype": "float64", "shape": [1], "data": [10**400]},
        {"type": "array", "dtype": "float64", "shape": [1], "data": ["x" * 10**6]},
        {"type": "array", "dtype": "float64", "shape": [1, 1], "data": [[1], [1, 2]]},
        {"type": []},
        {"type": {"type": "x"}},
        10**400,
        float("nan"),
        {1},
        b"bytes",
    ],
    ids=lambda record: str(record)[:50],
)
def test_a_record_that_cannot_be_is_refused_in_a_sentence(record):
    with pytest.raises(CrfDeblurError) as refused:
        from_record(record)
    assert str(refused.value).isprintable()


def test_records_nested_too_deeply_are_refused():
    for wrap in (lambda each: [each], lambda each: {"a": each}, tuned, kept):
        record = 1
        for _ in range(5000):
            record = wrap(record)
        with pytest.raises(CrfDeblurError, match="within each other"):
            from_record(record)
    endless = []
    endless.append(endless)
    with pytest.raises(CrfDeblurError, match="within each other"):
        from_record(endless)


def tuned(record):
    return {"type": "Tuned", "base": record, "offsets": [0.1], "exponent": 1.0}


def kept(record):
    return {"type": "dict", "items": {"type": record}}


def test_a_journal_leaves_out_lines_that_make_no_sense(tmp_path):
    path, lines = tmp_path / NAME, []
    head = {"format": "crfdeblur-batch", "version": 1}
    valid = [
        {"kind": "claim", "photo": "a.jpg", "result": "a-x.jpg"},
        {"kind": "done", "name": "a-x.jpg", "photo": [1, 2], "settings": "s", "result": [3, 4]},
        {"kind": "psf", "settings": "s", "photos": ["a.jpg"]},
    ]
    rng = np.random.default_rng(14)
    for entry in valid:
        lines += [text.encode() for text in documents(entry, rng, 25)]
    lines += [line for line in NO_JSON if b"\n" not in line]
    path.write_bytes(b"\n".join([json.dumps(head).encode(), *lines, json.dumps(valid[2]).encode()]))
    journal = Journal.of(tmp_path)
    assert journal.found("psf", "s", [tmp_path / "a.jpg"]) is False
    assert journal.shared["psf"] == valid[2]
    assert all(isinstance(each, str) for each in (*journal.owners, *journal.owners.values()))


@pytest.mark.parametrize("first", [*NO_JSON, b"[1]", b'{"format": 1}', b'{"format": null}'])
def test_a_journal_that_is_none_is_refused_and_kept(tmp_path, first):
    (tmp_path / NAME).write_bytes(first)
    assert read_or_refused(lambda path: Journal.of(path.parent), tmp_path / NAME) is None
    assert (tmp_path / NAME).read_bytes() == first


def test_json_larger_than_the_limit_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(json.dumps([0.5] * 1000), encoding="utf-8")
    assert read_json(path) == [0.5] * 1000
    with pytest.raises(CrfDeblurError, match="too large"):
        read_json(path, limits=Limits(json=1000))
    with path.open("wb") as file:
        file.truncate(1 << 40)  # of no blocks
    with pytest.raises(CrfDeblurError, match="too large"):
        read_json(path)


def test_nesting_is_counted_and_may_be_allowed():
    text = "[" * 50 + "]" * 50
    assert parse_json(text, limits=Limits(nesting=50))
    with pytest.raises(ValueError, match="49 lists"):
        parse_json(text, limits=Limits(nesting=49))


def test_a_mark_of_byte_order_does_no_harm(tmp_path):
    (tmp_path / "a.json").write_bytes(b"\xef\xbb\xbf" + json.dumps(EDGES).encode())
    assert len(read_edges(tmp_path / "a.json")) == 2


def test_every_place_of_a_document_is_found_and_changed():
    found = list(places(EDGES))
    assert ("edges", 1, "corners", 3, 1) in found
    assert with_value(EDGES, ("edges", 0, "start", 1), 7)["edges"][0]["start"] == [1, 7]
    assert EDGES["edges"][0]["start"] == [1, 2]
