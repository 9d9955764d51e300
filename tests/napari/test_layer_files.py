"""Files of the library open as layers, and layers are saved as files of the library."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from napari.layers import Image, Shapes

from napari_crfdeblur import CrfDeblurError
from napari_crfdeblur._napari.files import KEY, get_reader
from napari_crfdeblur.edges import Edge, EdgeStatus, Line
from napari_crfdeblur.estimate import GivenResponse, ResponseEstimate, ResponseStatus
from napari_crfdeblur.io import read_edges, read_responses, write_edges, write_responses
from napari_crfdeblur.response import Gamma, GeneralizedGamma

PLUGIN = "napari-crfdeblur"
EDGES = (
    Edge((3.0, 4.5), (40.25, 17.0), polarity=1, width=7.5, contrast=0.4),
    Edge((10.0, 60.0), (55.0, 52.0), polarity=-1, width=6.0, contrast=0.7),
    Edge((1.0, 1.0), (2.0, 30.0), status=EdgeStatus.FAINT),
)

pytestmark = pytest.mark.usefixtures("plugin")


def estimated(curve: Any) -> ResponseEstimate:
    intensity = np.linspace(0, 1, 33)
    irradiance = curve.to_irradiance(intensity)
    band = np.minimum(0.2, irradiance), np.minimum(0.2, 1 - irradiance)
    return ResponseEstimate(
        curve,
        intensity,
        irradiance - band[0],
        irradiance + band[1],
        (0.1, 0.8),
        ResponseStatus.GOOD,
    )


@pytest.fixture
def edge_file(tmp_path: Path) -> Path:
    path = tmp_path / "Street.JSON"
    write_edges(tmp_path / "street.json", EDGES)
    return (tmp_path / "street.json").rename(path)


@pytest.fixture(params=[1, 3], ids=["one response", "one for each channel"])
def response_file(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    path = tmp_path / "camera.json"
    curves = [Gamma(2.2), Gamma(1.9), GeneralizedGamma((0.85, -0.75, 0.25))][: request.param]
    write_responses(path, [estimated(curve) for curve in curves])
    return path


def pixels_of(path: Path) -> Any:
    reader = get_reader(str(path))
    assert reader is not None
    ((pixels, _, _),) = reader(str(path))
    return pixels


def test_good_edges_open_as_lines_with_what_is_known_of_them(
    viewer: ViewerModel, edge_file: Path
) -> None:
    (layer,) = viewer.open(edge_file, plugin=None)
    assert isinstance(layer, Shapes)
    assert layer.shape_type == ["line", "line"]
    for vertices, edge in zip(layer.data, EDGES, strict=False):
        assert np.allclose(vertices, [edge.start, edge.end])
    assert layer.features["width"].tolist() == [7.5, 6.0]
    assert layer.features["polarity"].tolist() == [1, -1]


def test_rectangles_and_lines_without_measurements_open_too(
    viewer: ViewerModel, tmp_path: Path
) -> None:
    corners = [[1, 2], [1, 40], [12, 40], [12, 2]]
    entries = [{"corners": corners}, {"start": [5, 6], "end": [7, 30]}]
    path = tmp_path / "drawn.edges.json"
    path.write_text(json.dumps({"edges": entries, "format": "crfdeblur-edges"}))
    (layer,) = viewer.open(path, plugin=None)
    assert layer.shape_type == ["rectangle", "line"]
    assert np.allclose(layer.data[0], corners)


@pytest.mark.parametrize("suffix", [".json", ".edges.csv"])
def test_edges_come_back_from_a_saved_layer(
    viewer: ViewerModel, edge_file: Path, tmp_path: Path, suffix: str
) -> None:
    (layer,) = viewer.open(edge_file, plugin=None)
    saved = tmp_path / f"saved{suffix}"
    assert layer.save(str(saved)) == [str(saved)]
    if suffix == ".json":
        assert read_edges(saved) == tuple(Line(edge.start, edge.end) for edge in EDGES[:2])
        (again,) = viewer.open(saved, plugin=None)
        assert again.features["contrast"].tolist() == [0.4, 0.7]
    else:
        numbers = saved.read_text(encoding="utf-8").replace("\n", ",").split(",")
        assert {"40.25", "17.0"} <= {number.strip() for number in numbers}


def test_a_rejected_edge_of_a_layer_is_saved_as_rejected(tmp_path: Path) -> None:
    good, bad = [[1.0, 2.0], [30.0, 4.0]], [[5.0, 6.0], [7.0, 50.0]]
    status = [EdgeStatus.GOOD.value, EdgeStatus.CURVED.value]
    layer = Shapes([good, bad], shape_type="line", features={"status": status})
    layer.save(str(tmp_path / "saved.json"))
    assert read_edges(tmp_path / "saved.json") == (Line((1.0, 2.0), (30.0, 4.0)),)


@pytest.mark.parametrize(
    ("vertices", "kind"),
    [
        ([[1, 2], [1, 40], [12, 40], [12, 2]], "rectangle"),
        ([[1, 2], [1, 40], [12, 40]], "path"),
        ([[3, 4], [3, 4]], "line"),
    ],
)
def test_what_is_no_line_is_refused_by_its_number(
    tmp_path: Path, vertices: list[list[int]], kind: str
) -> None:
    layer = Shapes([[[0, 0], [9, 20]]], shape_type="line", name="mine")
    layer.add([np.array(vertices)], shape_type=kind)
    with pytest.raises(CrfDeblurError, match="shape 2 of “mine”"):
        layer.save(str(tmp_path / "saved.json"))
    assert not (tmp_path / "saved.json").exists()


def test_a_response_opens_as_a_picture_that_carries_it(
    viewer: ViewerModel, response_file: Path
) -> None:
    (layer,) = viewer.open(response_file, plugin=None)
    assert isinstance(layer, Image)
    assert layer.rgb
    assert layer.data.dtype == np.uint8
    assert len(np.unique(layer.data.reshape(-1, 4), axis=0)) > 20, "an empty picture"
    assert tuple(layer.contrast_limits) == (0, 255)
    assert layer.metadata[KEY]["response"] == json.loads(response_file.read_text())


def test_the_picture_shows_the_band_of_the_file(tmp_path: Path) -> None:
    write_responses(tmp_path / "band.json", [estimated(Gamma(2.2))])
    write_responses(tmp_path / "given.json", [GivenResponse(Gamma(2.2)).estimate()])
    band, given = (pixels_of(tmp_path / f"{name}.json") for name in ("band", "given"))
    assert not np.array_equal(band, given)


@pytest.mark.parametrize("status", ResponseStatus)
def test_every_status_and_keys_of_later_versions_open(
    tmp_path: Path, status: ResponseStatus
) -> None:
    path = tmp_path / "camera.json"
    write_responses(path, [estimated(Gamma(2.2))])
    shown = pixels_of(path)
    content = json.loads(path.read_text())
    content["channels"][0] |= {"status": status.name.lower(), "of a later version": ["ALIKE", 3]}
    path.write_text(json.dumps(content | {"later": {}}))
    banded = status is not ResponseStatus.GIVEN
    assert np.array_equal(pixels_of(path)[..., 3], shown[..., 3])
    assert np.array_equal(pixels_of(path), shown) == banded


@pytest.mark.parametrize("damage", [{"lower": [0.0]}, {"covered": 3}, {"status": "unheard of"}])
def test_a_band_that_makes_no_sense_is_left_out(tmp_path: Path, damage: dict[str, Any]) -> None:
    path = tmp_path / "camera.json"
    write_responses(path, [estimated(Gamma(2.2))])
    content = json.loads(path.read_text())
    content["channels"][0] |= damage
    path.write_text(json.dumps(content))
    write_responses(tmp_path / "given.json", [GivenResponse(read_responses(path)[0]).estimate()])
    assert np.array_equal(pixels_of(path), pixels_of(tmp_path / "given.json"))


def test_a_response_comes_back_from_a_saved_layer(
    viewer: ViewerModel, response_file: Path, tmp_path: Path
) -> None:
    (layer,) = viewer.open(response_file, plugin=None)
    layer.save(str(tmp_path / "saved.json"))
    written, given = read_responses(tmp_path / "saved.json"), read_responses(response_file)
    for own, other in zip(written, given, strict=True):
        assert np.array_equal(own.to_irradiance([0.2, 0.7]), other.to_irradiance([0.2, 0.7]))


@pytest.mark.parametrize("metadata", [{}, {KEY: {"response": None}}])
def test_a_layer_without_a_response_says_so(tmp_path: Path, metadata: dict[str, Any]) -> None:
    layer = Image(np.zeros((8, 9)), name="plain", metadata=metadata)
    with pytest.raises(CrfDeblurError, match="“plain” holds no camera response"):
        layer.save(str(tmp_path / "saved.json"))


def test_a_response_that_makes_no_sense_is_not_saved(tmp_path: Path) -> None:
    layer = Image(np.zeros((8, 9)), name="mine", metadata={KEY: {"response": {"format": "?"}}})
    with pytest.raises(CrfDeblurError, match="“mine”: not a response"):
        layer.save(str(tmp_path / "saved.json"))
    assert not (tmp_path / "saved.json").exists()


@pytest.mark.parametrize(
    "text",
    ['{"format": "crfdeblur-session"}', '{"type": "FeatureCollection"}', "[1, 2]", "", "{"],
)
def test_json_files_of_other_formats_are_left_to_others(tmp_path: Path, text: str) -> None:
    path = tmp_path / "other.json"
    path.write_text(text)
    assert get_reader(str(path)) is None


def test_missing_files_folders_and_addresses_are_left_to_others(tmp_path: Path) -> None:
    for path in (tmp_path / "missing.json", tmp_path, "https://example.org/edges.json"):
        assert get_reader(str(path)) is None


def test_several_files_open_together_only_if_all_are_ours(edge_file: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    other.write_text("{}")
    reader = get_reader([str(edge_file), str(edge_file)])
    assert reader is not None
    assert len(reader([str(edge_file), str(edge_file)])) == 2
    assert get_reader([str(edge_file), str(other)]) is None


@pytest.mark.parametrize("kind", ["edges", "response"])
def test_a_damaged_file_of_ours_is_refused_in_a_sentence(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "cut.json"
    path.write_text(f'{{"format": "crfdeblur-{kind}", "edges": [')
    with pytest.raises(CrfDeblurError, match=r"cut\.json: not a "):
        pixels_of(path)


@pytest.mark.parametrize(
    ("layer", "name", "written"),
    [
        (Image(np.zeros((8, 9), np.uint8)), "a.png", "a.png"),
        (Image(np.zeros((8, 9), np.uint8)), "a", "a.tif"),
        (Shapes([[[0, 0], [9, 20]]], shape_type="line"), "a.csv", "a.csv"),
        (Shapes([[[0, 0], [9, 20]]], shape_type="line"), "a", "a.csv"),
    ],
)
def test_napari_still_saves_what_it_saved_before(
    layer: Any, name: str, written: str, tmp_path: Path
) -> None:
    assert layer.save(str(tmp_path / name)) == [str(tmp_path / written)]
    if written.endswith(".csv"):
        assert (tmp_path / written).read_text().startswith("index,shape-type")
