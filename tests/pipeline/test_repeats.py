"""What was done can be done again: library, command, window, record and script agree."""

import io
import json
import subprocess
import sys
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from option_sets import OptionSet, by_the_library, by_verbs, in_a_session, option_sets
from tifffile import imwrite

from napari_crfdeblur import CrfDeblurError, DeblurOptions
from napari_crfdeblur.cli import main
from napari_crfdeblur.deconvolution import Wiener
from napari_crfdeblur.edges import Line
from napari_crfdeblur.estimate import GivenResponse, MaximumLikelihood
from napari_crfdeblur.io import (
    read_photo,
    read_record,
    record_content,
    record_from,
    write_photo,
    write_record,
)
from napari_crfdeblur.methods import DECONVOLUTIONS, PSFS
from napari_crfdeblur.pipeline import PhotoStack, Record, repeating
from napari_crfdeblur.pipeline.record import pixels_of
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import GivenPsf
from napari_crfdeblur.response import SRGB, Gamma, Identity

COUNT = 200
PARTS = 8  # of the sets, each a test
CURVES = (
    (MaximumLikelihood(), "auto"),
    (GivenResponse(SRGB()), "srgb"),
    (GivenResponse(Identity()), "identity"),
    (GivenResponse(Gamma(1.5)), "gamma:1.5"),
    (GivenResponse(Gamma(2.2)), "gamma:2.2"),
)
SAME = "the result is the same, pixel by pixel"


@pytest.fixture(scope="module")
def sets() -> list[OptionSet]:
    return list(option_sets(seed=5, count=COUNT))


def digest(pixels) -> str:
    return pixels_of("", np.asarray(pixels)).digest


def written(each: OptionSet, folder: Path) -> Path:
    """The photo in a file that every command reads."""
    pixels = each.stack.data
    if each.plane or pixels.dtype.kind == "f":
        path = folder / "photo.tif"
        imwrite(path, pixels, photometric="rgb" if each.stack.rgb else "minisblack")
        return path
    write_photo(folder / "photo.png", pixels)
    return folder / "photo.png"


@pytest.mark.parametrize("part", range(PARTS))
def test_every_way_gives_the_same_pixels(part: int, sets, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for number, each in list(enumerate(sets))[part::PARTS]:
        folder = tmp_path / str(number)
        folder.mkdir()
        pixels = by_the_library(each)
        if number % 3 == 0:  # layers cost more than the small photo itself
            record = in_the_window(each, number, pixels, monkeypatch)
        else:
            record = record_of(each, pixels)
        again(each, number, record, folder)
        words = said_in_words(each, folder)
        if words is not None:
            by_the_command(each, words, pixels, folder)


def record_of(each: OptionSet, pixels: np.ndarray) -> Record:
    """The record of what the library has done."""
    return Record(
        photo=pixels_of(each.stack.name, each.stack.data),
        options=each.options,
        plane=each.plane,
        region=each.region,
        white=each.stack.white,
        result=pixels_of(each.stack.name, pixels),
    )


def in_the_window(each: OptionSet, number: int, pixels: np.ndarray, monkeypatch) -> Record:
    """All at once or verb by verb, and again by a session or by the script; the record."""
    session = in_a_session(each)
    if each.whole and number % 2:
        layer = session.deblur(each.options)
        assert digest(layer.data) == digest(pixels), (number, each)
    else:
        made = by_verbs(session, each, in_one=number % 4 == 0)
        assert digest(made) == digest(pixels), (number, each)
    content = session.record()
    if number % 9 == 3:
        assert SAME in in_a_session(each).repeat(content), (number, each)
    elif number % 9 == 6:
        result, said = run_here(session.script(), each, monkeypatch)
        assert digest(result) == digest(pixels), (number, each)
        assert SAME in said, (number, each)
    return record_from(content, "the session")


def again(each: OptionSet, number: int, record: Record, folder: Path) -> None:
    """The record repeated by the library or by the command."""
    if number % 2:
        repeated = drain(repeating(record, each.stack))
        assert (repeated.same_photo, repeated.same_result) == (True, True), (number, each)
        return
    write_record(folder / "record.json", record)
    before = (folder / "record.json").read_bytes()
    photo = written(each, folder)
    assert main(["repeat", str(folder / "record.json"), str(photo)]) == 0, (number, each)
    assert (folder / "record.json").read_bytes() == before


def by_the_command(each: OptionSet, words: list[str], pixels: np.ndarray, folder: Path) -> None:
    """The command gives the same pixels, and its record repeats them."""
    photo, record = written(each, folder), folder / "said.json"
    output = folder / f"sharp{photo.suffix}"
    assert main(["deblur", str(photo), "-o", str(output), "--record", str(record), *words]) == 0
    assert digest(read_photo(output)) == digest(pixels), (words, each)
    assert drain(repeating(read_record(record), each.stack)).same_result


def said_in_words(each: OptionSet, folder: Path) -> list[str] | None:
    """Arguments of `crfdeblur deblur` that say the options; None if it has none for them."""
    options, psf = each.options, each.options.psf
    method = next((m.word for m in DECONVOLUTIONS if m.make() == options.method), None)
    if each.plane or not each.whole or each.stack.white is not None or method is None:
        return None
    response = next((word for fit, word in CURVES if fit == options.response), None)
    if response is None or options.regions is not None:
        return None
    words = ["--response", response, "--method", method]
    if isinstance(psf, GivenPsf):
        np.save(folder / "psf.npy", psf.psf)
        words += ["--psf", str(folder / "psf.npy")]
    elif psf is not None:
        word = next(m.word for m in PSFS if m.make(size=psf.size) == psf)
        words += ["--psf", word, "--psf-size", str(psf.size)]
    if options.blur_extent is not None:
        words += ["--blur-extent", repr(options.blur_extent)]
    if options.edges is not None:
        if not all(isinstance(edge, Line) for edge in options.edges):
            return None
        lines = [{"start": edge.start, "end": edge.end} for edge in options.edges]
        content = {"format": "crfdeblur-edges", "version": 1, "edges": lines}
        (folder / "edges.json").write_text(json.dumps(content))
        words += ["--edges", str(folder / "edges.json")]
    return words


def run_here(script: str, each: OptionSet, monkeypatch) -> tuple[np.ndarray, str]:
    """The script in this process: the photo is handed to it, and its results are taken."""
    results: list[np.ndarray] = []
    with monkeypatch.context() as patch, redirect_stdout(io.StringIO()) as said:
        patch.setattr("napari_crfdeblur.io.read_photo", lambda _: each.stack.data)
        patch.setattr("napari_crfdeblur.io.write_photo", lambda _, pixels: results.append(pixels))
        patch.setattr("tifffile.imwrite", lambda _, pixels: results.append(pixels))
        patch.setattr("tifffile.imread", lambda _: each.stack.data)
        patch.setattr(sys, "argv", ["script", "photo"])
        exec(compile(script, "script", "exec"), {"__name__": "__main__"})
    return results[0], said.getvalue()


def test_some_sets_can_be_said_on_the_command_line(sets, tmp_path: Path) -> None:
    assert sum(said_in_words(each, tmp_path) is not None for each in sets) >= 10


@pytest.fixture
def known(tmp_path: Path) -> tuple[Record, Path, Path]:
    """A record of a small photo, and the files of both."""
    each = OptionSet(
        PhotoStack(np.random.default_rng(1).integers(0, 255, (31, 44), dtype=np.uint8), False),
        DeblurOptions(
            response=GivenResponse(SRGB()), psf=GivenPsf(np.full((1, 3), 1 / 3)), method=Wiener()
        ),
    )
    record = record_of(each, by_the_library(each))
    write_record(tmp_path / "record.json", record)
    return record, tmp_path / "record.json", written(each, tmp_path)


def refused(argv: list[str], capsys) -> str:
    assert main(argv) == 2
    said = capsys.readouterr().err
    assert one_sentence(said), said
    return said


@pytest.mark.parametrize("field", ["restore_into", "path", "overwrite", "actions"])
def test_a_record_with_a_surplus_field_is_refused(field: str, known, capsys, tmp_path) -> None:
    _, path, photo = known
    content = json.loads(path.read_text())
    content["record"][field] = str(tmp_path / "stolen.tif")
    check_refused(content, path, photo, capsys)


@pytest.mark.parametrize(
    "change",
    [
        {"version": 99},
        {"version": "1"},
        {"format": "crfdeblur-response"},
        {"record": None},
        {"record": {"type": "Record"}},
    ],
    ids=str,
)
def test_what_is_no_record_of_this_version_is_refused(change, known, capsys) -> None:
    _, path, photo = known
    check_refused(json.loads(path.read_text()) | change, path, photo, capsys)


@pytest.mark.parametrize("kind", ["MagicWand", "Session", "Path", "Tiled"])
def test_an_unknown_method_is_refused(kind: str, known, capsys) -> None:
    _, path, photo = known
    content = json.loads(path.read_text())
    content["record"]["options"]["method"]["type"] = kind
    check_refused(content, path, photo, capsys)


def check_refused(content, path: Path, photo: Path, capsys) -> None:
    """By the command and by a session alike, and nothing is written or changed."""
    path.write_text(json.dumps(content))
    before = everything(path.parent)
    assert refused(["repeat", str(path), str(photo), "-o", str(path.parent / "out.png")], capsys)
    session = in_a_session(OptionSet(PhotoStack(read_photo(photo), False), DeblurOptions()))
    layers = list(session.viewer.layers)
    for saved in (content, path):
        with pytest.raises(CrfDeblurError):
            session.repeat(saved)
    assert session.state.found == (None,) * 4
    assert session.state.record is None
    assert list(session.viewer.layers) == layers
    assert everything(path.parent) == before


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_truncated_record_is_refused(share: float, known, capsys) -> None:
    _, path, photo = known
    text = path.read_text().rstrip()
    path.write_text(text[: int(share * len(text))])
    before = everything(path.parent)
    refused(["repeat", str(path), str(photo)], capsys)
    assert everything(path.parent) == before


def test_another_photo_is_said_and_done(known, tmp_path: Path, capsys) -> None:
    record, path, _ = known
    other = 255 - read_photo(tmp_path / "photo.png")
    write_photo(tmp_path / "other.png", other)
    asked = ["repeat", str(path), str(tmp_path / "other.png"), "-o", str(tmp_path / "o.png")]
    assert main(asked) == 0, "there is nothing to compare"
    said = capsys.readouterr()
    assert "another photo" in said.out + said.err
    repeated = drain(repeating(record, PhotoStack(other, False)))
    assert not repeated.same_photo
    assert digest(read_photo(tmp_path / "o.png")) == digest(repeated.restored.photo)


def test_another_version_is_said_and_done(known) -> None:
    record, _, photo = known
    old = replace(record, versions={**record.versions, "numpy": "1.0"})
    said = drain(repeating(old, PhotoStack(read_photo(photo), False))).sentences
    assert any("made with numpy 1.0" in sentence for sentence in said)
    assert SAME in said


def test_a_record_of_a_stack_is_refused_on_a_single_picture(known, capsys, tmp_path) -> None:
    record, _, photo = known
    write_record(tmp_path / "stack.json", replace(record, plane=(1,)))
    before = everything(tmp_path)
    refused(["repeat", str(tmp_path / "stack.json"), str(photo)], capsys)
    session = in_a_session(OptionSet(PhotoStack(read_photo(photo), False), DeblurOptions()))
    with pytest.raises(CrfDeblurError, match="axes"):
        session.repeat(tmp_path / "stack.json")
    assert len(session.viewer.layers) == 1
    assert everything(tmp_path) == before


def test_a_record_is_not_overwritten_by_its_repeat(known, capsys) -> None:
    _, path, photo = known
    before = everything(path.parent)
    refused(["repeat", str(path), str(photo), "-o", str(path)], capsys)
    assert everything(path.parent) == before


def test_a_record_names_no_file(sets) -> None:
    for each in sets:
        record = record_of(each, np.zeros((2, 2)))
        for text in texts(record_content(record)):
            assert not {"/", "\\"} & set(text), text


def texts(content) -> list[str]:
    """All texts of a JSON, keys included."""
    if isinstance(content, str):
        return [content]
    if isinstance(content, dict):
        return [*content, *(text for each in content.values() for text in texts(each))]
    return [text for each in content for text in texts(each)] if isinstance(content, list) else []


def test_the_script_of_a_photo_runs_alone(known, tmp_path: Path) -> None:
    record, _, photo = known
    each = OptionSet(PhotoStack(read_photo(photo), False, name="photo"), record.options)
    session = in_a_session(each)
    session.deblur(each.options)
    (tmp_path / "again.py").write_text(session.script())
    done = subprocess.run(
        [sys.executable, "again.py", photo.name], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert SAME in done.stdout
    assert digest(read_photo(tmp_path / "photo-deblurred.png")) == record.result.digest


def one_sentence(error: str) -> bool:
    """Whether this is one line of a refusal."""
    line = error.removesuffix("\n")
    return line.startswith("crfdeblur: ") and line.isprintable()


def everything(folder: Path) -> dict[str, bytes]:
    """Contents of all files, by name."""
    return {str(p): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_the_white_level_of_the_record_counts_not_that_of_the_session(known) -> None:
    record, _, photo = known
    each = OptionSet(PhotoStack(read_photo(photo), False, white=90.0), record.options)
    session = in_a_session(each)
    assert SAME in session.repeat(record)
    assert session.white is None
