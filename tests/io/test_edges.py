"""Edges in JSON files: drawn or found, and what is refused."""

import json
from math import nan

import pytest

from napari_crfdeblur.edges import Edge, EdgeStatus, Line, Rectangle
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import read_edges, write_edges

FOUND = (
    Edge((3.5, 4.25), (40.0, 9.0), 1, 11.5, 0.3),
    Edge((7.0, 60.0), (8.0, 90.0), -1, 12.5, 0.2, EdgeStatus.CLIPPED),
    Edge((70.0, 6.0), (8.0, 9.0), 0, 9.5, 0.4),
)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "edges.json"


def test_good_edges_come_back_as_lines(path):
    write_edges(path, FOUND)
    assert read_edges(path) == tuple(Line(e.start, e.end) for e in FOUND if e.good)


def test_rejected_edges_are_written_with_their_reason(path):
    write_edges(path, FOUND)
    entry = json.loads(path.read_text(encoding="utf-8"))["edges"][1]
    assert (entry["status"], entry["message"]) == ("clipped", EdgeStatus.CLIPPED.value)


def test_what_a_user_wrote_by_hand_is_read(path):
    corners = [[1, 2], [3, 9], [8, 7], [6, 0]]
    drawn = [{"start": [1, 2], "end": [30, 4]}, {"corners": corners}]
    path.write_text(json.dumps({"format": "crfdeblur-edges", "edges": drawn}), encoding="utf-8")
    rectangle = Rectangle(((1, 2), (3, 9), (8, 7), (6, 0)))
    assert read_edges(path) == (Line((1, 2), (30, 4)), rectangle)


def of(*edges):
    return {"format": "crfdeblur-edges", "version": 1, "edges": list(edges)}


@pytest.mark.parametrize(
    "content",
    [
        [],
        {},
        {"format": "crfdeblur-response", "edges": []},
        {"format": "crfdeblur-edges"},
        {"format": "crfdeblur-edges", "edges": 3},
        {"format": "crfdeblur-edges", "edges": None},
        of(None),
        of([1, 2, 3, 4]),
        of({"start": [1, 2]}),
        of({"start": [1, 2], "end": [1, 2]}),
        of({"start": [1, 2], "end": [1, nan]}),
        of({"start": [1, 2], "end": [1, 1e999]}),
        of({"start": [1, 2, 3], "end": [4, 5, 6]}),
        of({"start": "ab", "end": [4, 5]}),
        of({"start": 1, "end": 2}),
        of({"corners": [[1, 2], [3, 4], [5, 6]]}),
        of({"corners": [[1, 2], [3, 4], [5, 6], [nan, 8]]}),
        of({"corners": 4}),
    ],
)
def test_a_file_that_holds_no_edges_is_refused_with_an_example(path, content):
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(CrfDeblurError, match=r"edges\.json: not a file of edges .* expected"):
        read_edges(path)


@pytest.mark.parametrize("raw", [b"", b"12, 14", b"\xff\xfe\x00", b"[" * 100_000])
def test_what_is_no_json_is_refused(path, raw):
    path.write_bytes(raw)
    with pytest.raises(CrfDeblurError, match=r"edges\.json: not a file of edges"):
        read_edges(path)


def test_a_file_of_rejected_edges_alone_is_refused(path):
    write_edges(path, FOUND[1:2])
    with pytest.raises(CrfDeblurError, match="no edges in it"):
        read_edges(path)


def test_missing_file_is_refused(path):
    with pytest.raises(CrfDeblurError, match="no such file"):
        read_edges(path)
