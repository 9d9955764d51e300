"""No run of the command destroys what it reads, or ends with a part of its outputs."""

import os
from pathlib import Path

import numpy as np
import pytest
from small_runs import KNOWN, everything, one_sentence, unfinished

from napari_crfdeblur import demo
from napari_crfdeblur.cli import deblur, estimate, main, simulate
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import read_photo

ALL = [*KNOWN, "--edges", "edges.json"]
COMMANDS = {
    "deblur": ["deblur", "photo.png", "-o", "out.png", *ALL],
    "curve": ["deblur", "photo.png", "-o", "out.png", *ALL, "--response", "curve.json"],
    "prior": ["deblur", "photo.png", "-o", "out.png", *ALL[2:], "--prior", "curve.json"],
    "psf": ["psf", "photo.png", "-o", "k.png", "--response", "srgb", "--edges", "edges.json"],
    "estimate": [
        "estimate",
        "photo.png",
        "-o",
        "e.json",
        "--psf",
        "psf.png",
        "--prior",
        "curve.json",
    ],
    "edges": ["estimate", "photo.png", "-o", "e.json", "--edges", "edges.json"],
    "simulate": ["simulate", "-o", "new.png", "--psf", "psf.png", "--response", "curve.json"],
}
OUTPUTS = {"-o", "--report", "--save-edges"}
KINDS = {
    ("-o", "estimate"): (".json",),
    "-o": (".png",),
    "--report": (".png", ".html"),
    "--save-edges": (".json", ".csv"),
}


def linked(name):
    Path("alias").mkdir()
    (Path("alias") / name).symlink_to(Path(name).absolute())
    return f"alias/{name}"


def hard_linked(name):
    Path("alias").mkdir()
    os.link(name, f"alias/{name}")
    return f"alias/{name}"


ALIASES = {
    "itself": lambda name: name,
    "dots": lambda name: f"./../{Path.cwd().name}/{name}",
    "capitals": lambda name: name.swapcase(),
    "link": linked,
    "hard link": hard_linked,
}


def collisions():
    """Command lines in which an output is one of the inputs."""
    for label, line in COMMANDS.items():
        read = [text for text in line if Path(text).suffix and text not in ("out.png", "k.png")]
        for option in sorted(OUTPUTS if line[0] != "simulate" else {"-o"}):
            kinds = KINDS.get((option, line[0])) or KINDS[option]
            for name in sorted(set(read) - {"e.json", "new.png"}):
                if Path(name).suffix in kinds:
                    yield pytest.param(line, option, name, id=f"{label} {option} {name}")


def said(capsys, arguments):
    """What is said of a run that is refused and changes nothing."""
    before = everything()
    assert main([str(each) for each in arguments]) == 2
    out, error = capsys.readouterr()
    assert everything() == before
    assert not unfinished()
    assert out == ""
    assert one_sentence(error)
    return error


@pytest.mark.parametrize("alias", ALIASES)
@pytest.mark.parametrize(("line", "option", "name"), [*collisions()])
@pytest.mark.usefixtures("here")
def test_no_output_can_be_an_input(capsys, line, option, name, alias):
    error = said(capsys, [*line, option, ALIASES[alias](name)])
    assert "is read by this run" in error


@pytest.mark.parametrize(
    ("line", "options"),
    [
        ("deblur", ["--report", "out.png"]),
        ("deblur", ["--report", "./OUT.png"]),
        ("psf", ["--report", "k.png"]),
        ("estimate", ["--save-edges", "e.json"]),
        ("edges", ["--save-edges", "E.JSON"]),
    ],
)
@pytest.mark.usefixtures("here")
def test_no_output_can_be_another(capsys, line, options):
    assert "is written by this run already" in said(capsys, [*COMMANDS[line], *options])


@pytest.mark.parametrize("name", ["new-sharp.png", "new-response.json"])
def test_what_is_written_beside_a_simulated_photo_is_no_input_either(here, capsys, name):
    source = "psf.png" if name.endswith("png") else "curve.json"
    (here / source).rename(here / name)
    line = [name if text == source else text for text in COMMANDS["simulate"]]
    assert f"{name}: is read by this run" in said(capsys, line)


@pytest.mark.parametrize(
    ("photo", "output", "reason"),
    [
        ("data.zarr/0", "data.zarr", "not a single array of zarr"),
        ("data.zarr", "data.zarr", "not a single array of zarr"),
        ("data.zarr", "data.zarr/0", "written as TIFF or zarr"),
        ("data.zarr", "data.zarr/new.tif", "lies in data.zarr"),
        ("data.zarr/0", "data.zarr/0/c/new.zarr", "lies in data.zarr/0"),
        ("single.zarr", "single.zarr", "is read by this run"),
        ("single.zarr", "link.zarr", "is read by this run, as single.zarr"),
        ("photo.tif", "holder.zarr", "holds holder.zarr/photo.tif"),
    ],
)
def test_no_zarr_is_replaced_by_what_is_made_of_it(here, capsys, photo, output, reason):
    zarr = pytest.importorskip("zarr")
    pixels = read_photo(here / "photo.png")[..., 1]
    group = zarr.open_group(here / "data.zarr", mode="w")
    for name in ("0", "1"):
        group.create_array(name, data=pixels)
    zarr.create_array(here / "single.zarr", data=pixels)
    (here / "link.zarr").symlink_to(here / "single.zarr")
    if photo == "photo.tif":
        zarr.create_array(here / "holder.zarr", data=pixels)
        photo = "holder.zarr/photo.tif"
        main(["deblur", "photo.png", *KNOWN, "--tiled", "-o", photo])
        capsys.readouterr()
    error = said(capsys, ["deblur", photo, *KNOWN, "-o", output, "--tiled"])
    assert reason in error


def test_an_older_output_is_replaced(here, capsys):
    for line, output in ((COMMANDS["deblur"], "out.png"), (COMMANDS["estimate"], "e.json")):
        (here / output).write_bytes(b"old")
        assert main(line) == 0
        assert (here / output).read_bytes() != b"old"
    assert "wrote out.png" in capsys.readouterr().out
    assert not unfinished()


def full(*_arguments, **_options):
    raise CrfDeblurError("no space is left; make room")


# Each with what writes its last output.
LAST = [
    ("deblur", "write_report", ["--save-edges", "found.json", "--report", "r.html"]),
    ("deblur", "write_edges", ["--save-edges", "found.json"]),
    ("psf", "write_report", ["--report", "r.html", "--psf-size", "5"]),
    ("estimate", "write_report", ["--save-edges", "found.json", "--report", "r.html"]),
    (
        "estimate",
        "keep_estimate",
        ["--cameras", "cameras/a", "--camera", "x", "--method", "likelihood"],
    ),
    ("simulate", "write_responses", ["--size", "64x64", "--scene", "step"]),
]


def replace_in_commands(monkeypatch, name, value):
    """Put something in the place of what the commands call by this name."""
    homes = [home for home in (deblur, estimate, simulate) if hasattr(home, name)]
    assert homes, name
    for home in homes:
        monkeypatch.setattr(home, name, value)


@pytest.mark.parametrize("there", [True, False], ids=["old outputs", "no outputs"])
@pytest.mark.parametrize(("line", "writer", "options"), LAST)
def test_if_the_last_output_fails_there_is_none(
    here, capsys, monkeypatch, line, writer, options, there
):
    for name in ("out.png", "k.png", "e.json", "new.png", "found.json", "r.html") * there:
        (here / name).write_bytes(b"old")
    replace_in_commands(monkeypatch, writer, full)
    before = everything()
    assert main([*COMMANDS[line], *options]) == 2
    assert everything() == before
    assert not unfinished()
    assert not (here / "cameras").exists()
    assert capsys.readouterr().err == "crfdeblur: no space is left; make room\n"


@pytest.mark.parametrize(
    ("line", "name", "options"),
    [
        ("deblur", "out.png", []),
        ("deblur", "r.html", ["--report", "r.html"]),
        ("estimate", "f.csv", ["--save-edges", "f.csv"]),
        ("simulate", "new-sharp.png", []),
        ("simulate", "new-psf.npy", []),
        ("simulate", "new-response.json", []),
    ],
)
@pytest.mark.parametrize("kind", ["folder", "circle", "pipe"])
def test_a_place_that_cannot_be_written_is_found_before_the_work(
    here, capsys, monkeypatch, line, name, options, kind
):
    for stage in ("deblurring", "profiling", "expose"):
        replace_in_commands(monkeypatch, stage, lambda *_, **__: pytest.fail("work has begun"))
    if kind == "folder":
        (here / name).mkdir()
    elif kind == "circle":
        (here / name).symlink_to(name)
    else:
        os.mkfifo(here / name)
    error = said(capsys, [*COMMANDS[line], *options])
    assert name in error


@pytest.mark.usefixtures("here")
def test_a_stored_camera_is_replaced_by_nothing_else(capsys):
    folder = Path("cameras")
    folder.mkdir()
    (folder / "one.json").write_text("{}")
    for option in ("-o", "--save-edges"):
        line = [*COMMANDS["estimate"], "--cameras", folder, "--camera", "x"]
        assert "is read by this run" in said(capsys, [*line, option, folder / "one.json"])


@pytest.mark.parametrize("name", ["crfdeblur-response.json", "crfdeblur-psf.npy"])
def test_what_a_batch_finds_is_none_of_its_inputs(here, capsys, name):
    (here / "out").mkdir()
    given = {"crfdeblur-response.json": "--prior", "crfdeblur-psf.npy": "--response"}[name]
    (here / "curve.json").rename(here / "out" / name)
    line = ["batch", "photo.png", "-o", "out", "--psf", "one", given, f"out/{name}"]
    assert "is read by this run" in said(capsys, line)


def test_a_result_that_is_given_as_a_photo_is_not_replaced(here, capsys):
    line = ["batch", "photo.png", "-o", ".", *KNOWN]
    assert main(line) == 0
    first = (here / "photo-deblurred.png").read_bytes()
    other = [*line[:2], "photo-deblurred.png", *line[2:], "--method", "richardson-lucy"]
    assert main(other) == 1
    assert "leave that out" in capsys.readouterr().out
    assert (here / "photo-deblurred.png").read_bytes() == first


def test_all_files_of_a_demonstration_are_planned(here, monkeypatch):
    monkeypatch.setattr(demo, "write_report", lambda path, _: path.write_text("report"))
    photo = read_photo(here / "photo.png")
    made = stand_in(photo)
    folder = here / "demo"
    monkeypatch.setattr(demo, "table", lambda _: "table")
    monkeypatch.setattr(demo, "before_after", lambda _: photo)
    monkeypatch.setattr(demo, "_report", lambda _: None)
    with demo.writing_demo(folder) as outputs:
        planned = {each.path for each in outputs.planned}
        demo.write(made, folder, outputs)
    assert set(folder.iterdir()) == planned
    (folder / "report.html").unlink()
    (folder / "report.html").mkdir()
    with pytest.raises(CrfDeblurError, match="is a folder"), demo.writing_demo(folder):
        pass


def stand_in(photo):
    """What a demonstration finds, without the work of finding it."""
    from types import SimpleNamespace as Some

    from napari_crfdeblur.estimate import GivenResponse

    psf = Some(psf=np.ones((3, 5)) / 15)
    truth = Some(photo=photo, sharp=photo, psf=psf.psf)
    found = [GivenResponse(demo.RESPONSE).estimate()]
    whole = Some(photo=photo, psf=psf, responses=found)
    trials = [Some(name=name, photo=photo) for name in demo.TRIALS]
    return Some(truth=truth, whole=whole, trials=trials)
