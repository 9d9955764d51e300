"""Edges in files: drawn or found, and what is refused."""

import csv
import json
from math import degrees, nan

import pytest

from napari_crfdeblur.edges import Edge, EdgeStatus, Line, Rectangle
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import read_edges, write_edges
from napari_crfdeblur.io.edges import COLUMNS, edges_content

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


def test_the_content_is_what_the_file_holds(path):
    write_edges(path, FOUND)
    assert json.loads(path.read_text(encoding="utf-8")) == edges_content(FOUND)


@pytest.mark.parametrize("name", ["edges.csv", "EDGES.CSV"])
def test_a_table_has_a_row_for_each_edge(tmp_path, name):
    write_edges(tmp_path / name, FOUND)
    with (tmp_path / name).open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert [row["number"] for row in rows] == ["0", "1", "2"]
    for row, edge in zip(rows, FOUND, strict=True):
        names = ("start_row", "start_column", "end_row", "end_column", "width", "contrast")
        known = (*edge.start, *edge.end, edge.width, edge.contrast)
        assert tuple(float(row[name]) for name in names) == known
        assert int(row["polarity"]) == edge.polarity
        assert (row["status"], row["message"]) == (edge.status.name.lower(), edge.status.value)
        assert float(row["angle"]) == pytest.approx(degrees(edge.orientation))


def test_the_angle_in_a_table_is_that_of_the_normal(tmp_path):
    write_edges(tmp_path / "edges.csv", [Edge((0.0, 5.0), (20.0, 5.0))])  # runs down the photo
    with (tmp_path / "edges.csv").open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    assert float(row["angle"]) == pytest.approx(0, abs=1e-9)


def test_no_edges_are_a_table_without_rows(tmp_path):
    write_edges(tmp_path / "edges.csv", [])
    assert (tmp_path / "edges.csv").read_text(encoding="utf-8") == ",".join(COLUMNS) + "\n"


def test_other_kinds_of_file_are_refused(tmp_path):
    with pytest.raises(CrfDeblurError, match=r"ends in \.json, \.csv"):
        write_edges(tmp_path / "edges.txt", FOUND)


def test_a_table_is_not_read_back(tmp_path):
    write_edges(tmp_path / "edges.csv", FOUND)
    with pytest.raises(CrfDeblurError, match=r"edges\.csv: not a file of edges"):
        read_edges(tmp_path / "edges.csv")


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
