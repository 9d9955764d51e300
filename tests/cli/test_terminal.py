"""Whatever the command is given, it ends in one sentence; and printing never fails."""

import io
import logging
import os
import subprocess
import sys
import warnings
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from small_runs import KNOWN, everything, one_sentence, unfinished

from napari_crfdeblur.cli import main, terminal
from napari_crfdeblur.cli.kinds import address
from napari_crfdeblur.texts import printable

RUNS = {
    "deblur": ["deblur", "photo.png", "-o", "out.png", *KNOWN],
    "tiles": ["deblur", "photo.png", "-o", "out.tif", "--tiled", *KNOWN],
    "batch": ["batch", "photo.png", "-o", "batch", *KNOWN],
    "estimate": ["estimate", "photo.png", "-o", "e.json", "--blur-extent", "5"],
    "psf": ["psf", "photo.png", "-o", "k.png", "--response", "srgb", "--from", "xu-jia"],
    "simulate": ["simulate", "-o", "new.png", "--size", "64x64", "--scene", "step"],
    "demo": ["demo", "--seed", "none"],  # refused in any case: a whole one takes a minute
}
READ = ["--response", "--prior", "--psf"]
FOUND = [*READ, "--edges", "--cameras", "-o", "--report", "--save-edges"]
FILES = {
    "deblur": FOUND,
    "tiles": FOUND,
    "batch": [*READ, "-o", "--suffix"],
    "estimate": FOUND[1:],
    "psf": [*FOUND[:2], *FOUND[3:]],
    "simulate": ["-o", "--psf", "--response"],
    "demo": ["-o"],
}
NUMBERS = {
    "deblur": ["--psf-size", "--blur-extent", "--varying", "--method", "--scheduler"],
    "tiles": ["--blur-extent", "--varying", "--scheduler", "--camera"],
    "batch": ["--psf-size", "--blur-extent", "--scheduler", "--method"],
    "estimate": ["--blur-extent", "--method", "--camera", "--per-channel"],
    "psf": ["--psf-size", "--blur-extent", "--from", "--camera"],
    "simulate": ["--psf-size", "--turn", "--size", "--noise", "--bits", "--seed", "--scene"],
    "demo": ["--seed", "--what"],
}
NAMES = [
    "",
    " ",
    "a\nb.png",
    "\x1b[31mred.png",
    "\x1b]0;title\x07.json",
    "'\"`$(x).png",
    "\udcff\udc80.png",
    "\u202egnp.png",
    "é☃.png",
    "-",
    "--",
    "-x.png",
    "a" * 300,
    "a" * 300 + ".png",
    "a" * 252 + ".png",
    "../" * 99,
    "/",
    ".",
    "..",
    "/dev/null",
    "/dev/full",
    "/dev/zero",
    "/proc/self/mem",
    "/proc/self/fd",
    "photo.png",
    "psf.png",
    "curve.json",
    "missing.png",
    "missing/out.png",
    "photo.png/out.png",
    "folder",
    "folder.png",
    "circle.png",
    "pipe.tif",
    "%s{}%(x)s.png",
    "nul\0.png",
]
VALUES = [
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "-1",
    "0",
    "00",
    "9" * 400,
    "1x1",
    "0x0",
    "-1x5",
    "1000x1000",
    "999999x999999",
    "16384x16384",
    "64x",
    "x",
    "3.5",
    "0x10",
    "²x²",
    "1_000",
    "999999",
    "1e6",
    "None",
    "tls://host:1",
    "ucx://host:1",
    "tcp://host",
    "tcp://host:99999999",
    "tcp://:1",
    "inproc://1",
    "host:1:2",
    "gamma:",
    "gamma:nan",
    "gamma:1e308",
]
COUNT = 360


def hostile_lines():
    """Command lines that are good but for one argument or two."""
    rng = np.random.default_rng(20)
    runs = [*RUNS]

    def one(among):
        return among[rng.integers(len(among))]

    for number in range(COUNT):
        run = runs[number % len(runs)]
        line = list(RUNS[run])
        for _ in range(1 + (rng.random() < 0.2)):
            match rng.integers(5):
                case 0:
                    line.append(one(NAMES))
                case 1:
                    line += [one(NUMBERS[run]), one([*VALUES, *NAMES])]
                case _:
                    line += [one(FILES[run]), one(NAMES)]
        yield line


@pytest.fixture
def hostile(here):
    """Things of all kinds that are no photos."""
    (here / "folder").mkdir()
    (here / "folder.png").mkdir()
    (here / "circle.png").symlink_to("circle.png")
    os.mkfifo(here / "pipe.tif")
    return here


@pytest.mark.usefixtures("hostile")
def test_every_line_ends_well_or_in_one_sentence(capsys):
    inputs = everything()
    ends = {0: 0, 1: 0, 2: 0}
    for line in hostile_lines():
        for name, content in inputs.items():  # of which a run may replace those it does not read
            Path(name).write_bytes(content)
        code = main(line)
        out, error = capsys.readouterr()
        assert error == "" if code < 2 else one_sentence(error), (line, error)
        assert all(each.isprintable() for each in out.splitlines()), (line, out)
        assert not unfinished(), line
        if "photo.png" in RUNS[line[0]]:
            assert Path("photo.png").read_bytes() == inputs["photo.png"], line
        ends[code] += 1
    assert ends[2] > COUNT / 2  # most are refused,
    assert ends[0] > COUNT / 60  # and some make sense


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["simulate", "--noise", "1e308"], "from 0 to 1"),
        (["simulate", "--noise", "nan"], "from 0 to 1"),
        (["simulate", "--noise", "-0.1"], "from 0 to 1"),
        (["simulate", "--turn", "inf"], "from -10 to 10"),
        (["simulate", "--seed", "-1"], "from 0 to 4294967295"),
        (["demo", "--seed", "9" * 400], "from 0 to 4294967295"),
        (["simulate", "--size", "999999x999999"], "64 to 16384"),
        (["simulate", "--size", "16384x16384"], "67 megapixels"),
        (["simulate", "--psf-size", "999999"], "from 3 to 999"),
        (["deblur", "photo.png", "--blur-extent", "1e6"], "at most 9999"),
        (["deblur", "photo.png", *KNOWN, "--blur-extent", "65"], "wider than the photo"),
        (["deblur", "photo.png", *KNOWN, "--blur-extent", "65", "--tiled"], "wider than the photo"),
        (["estimate", "photo.png", "--blur-extent", "65"], "wider than the photo"),
        (["deblur", "photo.png", "--varying", "1000x1000"], "1 to 99"),
        (["deblur", "photo.png", *KNOWN, "--varying", "9x9"], "ask for fewer"),
        (["deblur", "photo.png", *KNOWN, "--varying", "9x9", "--tiled"], "ask for fewer"),
        (["batch", "photo.png", "-o", "b", "--suffix", "a\nb"], "characters that can be seen"),
        (["batch", "photo.png", "-o", "b", "--suffix", "a" * 101], "at most 100"),
        (["deblur", ""], "an empty text"),
        (["deblur", "photo.png", "-o", ""], "an empty text"),
        (["deblur", "photo.png", "--psf", ""], "an empty text"),
        (["deblur", "/"], "no name"),
        (["deblur", "/", "-o", "out.tif"], "no array of zarr"),
        (["deblur", "/", "-o", "out.zarr"], "no array of zarr"),
        (["deblur", "missing/photo.png"], "no such file"),
        (["simulate", "-o", "."], "no name"),
        (["deblur", "photo.png", "--tild"], "unrecognized"),
        ([], "required"),
    ],
)
def test_what_is_beyond_the_limits_is_refused_with_them(hostile, capsys, arguments, reason):
    before = everything()
    assert main(arguments) == 2
    out, error = capsys.readouterr()
    assert reason in error
    assert one_sentence(error)
    assert out == ""
    assert everything() == before
    assert sorted(hostile.iterdir()) == sorted(set(hostile.iterdir()))


@pytest.mark.parametrize("text", ["tcp://host:8786", "host:1", "tcp://[::1]:65535", "10.0.0.1:80"])
def test_addresses_of_schedulers_are_taken(text):
    assert address(text) == text


@pytest.mark.parametrize("command", ["demo", "deblur", "batch", "estimate", "psf", "simulate"])
def test_the_help_tells_the_limits(command, capsys):
    with pytest.raises(SystemExit):
        main([command, "--help"])
    told = " ".join(capsys.readouterr().out.split())
    limits = {"--seed": "0 to 4294967295", "--psf-size": "3 to 999", "--varying": "1 to 99"}
    limits |= {"--size": "64 to 16384", "--noise": "0 to 1", "--suffix": "up to 100"}
    for option, limit in limits.items():
        if f" {option} " in told:
            assert limit in told, option


@pytest.mark.parametrize(
    "text", ["a\nb", "\x1b[2J", "\x00\x7f\x9b", "\u202e\u2028\ufeff", "\udcff", "a\tb\rc"]
)
def test_nothing_that_is_printed_can_do_harm(text):
    shown = printable(text)
    assert shown.isprintable()
    assert shown.encode("utf-8").decode("unicode_escape") == text


@pytest.mark.parametrize("text", ["photo.png", "Straße µ 写真 é", "a b", "c:\\x"])
def test_what_can_be_read_is_printed_as_it_is(text):
    assert printable(text) == text


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8", "utf-16"])
@pytest.mark.parametrize("text", ["写真 é \udcff \x1b", "plain"])
def test_a_terminal_of_any_encoding_gets_its_line(monkeypatch, encoding, text):
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding=encoding))
    terminal.say(text)
    line = raw.getvalue().decode(encoding)
    assert line.count("\n") == 1
    assert text.split()[0].encode(encoding, "backslashreplace").decode(encoding) in line


def broken_pipe():
    reader, writer = os.pipe()
    os.close(reader)
    return os.fdopen(writer, "w")


def full_disk():
    return open("/dev/full", "w")  # noqa: PTH123 - a stream that is left open


def closed_stream():
    stream = io.StringIO()
    stream.close()
    return stream


@pytest.mark.parametrize("stream", [broken_pipe, full_disk, closed_stream, lambda: None])
def test_nobody_reading_is_no_reason_to_fail(here, monkeypatch, stream):
    out, error = stream(), stream()
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", error)
    assert main(RUNS["deblur"]) == 0
    assert (here / "out.png").exists()
    assert main(["deblur", "missing.png", *KNOWN]) == 2
    for each in filter(None, (out, error)):
        each.close()  # what is left goes nowhere, without an error


@pytest.mark.parametrize(
    "arguments", [["--help"], ["deblur", "missing-é-\udcff\x1b.png"], ["--version"]]
)
def test_a_program_without_an_encoding_or_a_reader_says_no_more_than_that(here, arguments):
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "napari_crfdeblur.cli", *arguments],
        env=os.environ | {"LC_ALL": "C", "PYTHONIOENCODING": "ascii"},
        stdout=writer,
        stderr=subprocess.PIPE,
        check=False,
        cwd=here,
    )
    os.close(writer)
    error = done.stderr.decode("ascii")
    assert (done.returncode == 0 and error == "") or one_sentence(error)


def test_libraries_say_nothing_beside_the_sentence(here, capfd, monkeypatch):
    def noisy(_path, **_):
        logging.getLogger("distributed.comm").error("cannot connect")
        logging.getLogger("tifffile").warning("strange tag")
        warnings.showwarning("deprecated", UserWarning, "x.py", 1)
        raise ValueError("the photo is\nnone")

    home = import_module("napari_crfdeblur.cli.deblur")
    monkeypatch.setattr(home, "read_photo", noisy)
    disabled, shown = logging.root.manager.disable, warnings.showwarning
    assert main(RUNS["deblur"]) == 2
    assert capfd.readouterr().err == "crfdeblur: the photo is\\nnone\n"
    assert logging.root.manager.disable == disabled
    assert warnings.showwarning is shown
    assert here.exists()
