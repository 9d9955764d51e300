"""All outputs of a run are apart from its inputs, and appear together or not at all."""

import errno
import os
from itertools import combinations
from pathlib import Path

import pytest

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import Output, Outputs, check_apart, write_text
from napari_crfdeblur.io.places import PREFIX

ANY = (".txt", ".png", ".zarr")


def symbolic(path):
    other = path.with_name(f"link-to-{path.name}")
    other.symlink_to(path)
    return other


def symbolic_twice(path):
    return symbolic(symbolic(path))


def hard(path):
    other = path.with_name(f"second-{path.name}")
    os.link(path, other)
    return other


def through_a_linked_folder(path):
    folder = path.parent.with_name("folder-link")
    folder.symlink_to(path.parent)
    return folder / path.name


ALIASES = {
    "itself": lambda path: path,
    "dots": lambda path: path.parent / ".." / path.parent.name / "." / path.name,
    "relative": lambda path: Path(os.path.relpath(path)),
    "capitals": lambda path: path.with_name(path.name.swapcase()),
    "link": symbolic,
    "links": symbolic_twice,
    "hard link": hard,
    "linked folder": through_a_linked_folder,
}


@pytest.fixture
def photo(tmp_path):
    path = tmp_path / "in" / "Photo.txt"
    path.parent.mkdir()
    path.write_text("precious")
    return path


@pytest.mark.parametrize("alias", ALIASES)
def test_an_output_that_is_an_input_by_any_name_is_refused(photo, alias):
    with pytest.raises(CrfDeblurError, match=r"is read by this run.*; choose another name"):
        check_apart([photo], [ALIASES[alias](photo)])


@pytest.mark.parametrize("alias", ALIASES)
def test_two_outputs_that_are_one_by_any_name_are_refused(photo, alias):
    with pytest.raises(CrfDeblurError, match="is written by this run already"):
        check_apart([], [photo, ALIASES[alias](photo)])


@pytest.mark.parametrize("alias", ["itself", "dots", "relative", "capitals", "linked folder"])
def test_two_new_outputs_of_one_name_are_refused(photo, alias):
    new = photo.with_name("New.txt")
    with pytest.raises(CrfDeblurError, match="is written by this run already"):
        check_apart([photo], [new, ALIASES[alias](new)])


@pytest.mark.parametrize("there", [True, False])
@pytest.mark.parametrize("alias", ["itself", "dots", "link", "linked folder"])
def test_what_lies_in_the_other_is_refused(tmp_path, alias, there):
    folder = tmp_path / "in" / "data.zarr"
    (folder / "0").mkdir(parents=True)
    inside = folder / ("0" if there else "new") / "x.txt"
    named = ALIASES[alias](folder)
    with pytest.raises(CrfDeblurError, match=r"lies in .*, which is read by this run"):
        check_apart([named], [inside])
    with pytest.raises(CrfDeblurError, match=r"holds .*, which is read by this run"):
        check_apart([inside], [named])
    for pair in ([named, inside], [inside, named]):
        with pytest.raises(CrfDeblurError, match=r"(lies in|holds) .* written by this run already"):
            check_apart([], pair)


def test_neighbors_are_apart(tmp_path):
    (tmp_path / "data.zarr").mkdir()
    names = [
        "a.png",
        "a.tif",
        "a-psf.png",
        "data.zarr",
        "data",
        "data.zarr2",
        "in/a.png",
        "a/a.png",
    ]
    for one, other in combinations([tmp_path / name for name in names], 2):
        check_apart([one], [other])
        check_apart([other], [one])
        check_apart([], [one, other])


def test_two_files_that_differ_in_capitals_are_two_if_both_are_there(photo):
    twin = photo.with_name(photo.name.swapcase())
    twin.write_text("another")
    if twin.samefile(photo):
        pytest.skip("capitals make no difference here")
    check_apart([photo], [twin])


def test_a_circle_of_links_is_refused(tmp_path):
    (tmp_path / "a.txt").symlink_to(tmp_path / "b.txt")
    (tmp_path / "b.txt").symlink_to(tmp_path / "a.txt")
    for planned in ([tmp_path / "a.txt"], [tmp_path / "c.txt", tmp_path / "b.txt"]):
        with pytest.raises(CrfDeblurError, match="a link that leads in a circle"):
            enter([Output(path, ANY) for path in planned])


def enter(planned, folders=(), inputs=()):
    with Outputs(inputs, planned, folders):
        pass


@pytest.fixture
def three(tmp_path):
    """Three planned outputs in two folders, of which the first and the last are there already."""
    (tmp_path / "other").mkdir()
    paths = [tmp_path / "a.txt", tmp_path / "other" / "b.txt", tmp_path / "c.txt"]
    paths[0].write_text("old a")
    paths[2].write_text("old c")
    return paths


def everything(folder):
    return {p: p.read_text() for p in sorted(folder.rglob("*")) if p.is_file()}


def write_all(paths, fault=lambda _: None):
    with Outputs([], [Output(path, ANY) for path in paths]) as outputs:
        for number, path in enumerate(paths):
            write_text(outputs[path], f"new {path.name[0]}")
            fault(number)


def test_all_outputs_appear_at_the_end(three, tmp_path):
    before = everything(tmp_path)
    write_all(three, lambda _: {p: t for p, t in before.items() if p.read_text() != t} == {})
    assert everything(tmp_path) == {path: f"new {path.name[0]}" for path in three}
    assert not list(tmp_path.rglob(f"{PREFIX}*"))


@pytest.mark.parametrize("failure", [CrfDeblurError, KeyboardInterrupt, RuntimeError, OSError])
@pytest.mark.parametrize("number", range(3))
def test_a_run_that_fails_changes_nothing(three, tmp_path, failure, number):
    before = everything(tmp_path)

    def fault(at):
        if at == number:
            raise failure("at once")

    with pytest.raises(failure):
        write_all(three, fault)
    assert everything(tmp_path) == before
    assert not list(tmp_path.rglob(f"{PREFIX}*"))


@pytest.mark.parametrize("links", [True, False], ids=["hard links", "no hard links"])
@pytest.mark.parametrize("number", range(3))
def test_if_one_output_cannot_be_put_in_its_place_none_is(
    three, tmp_path, monkeypatch, number, links
):
    before, original = everything(tmp_path), Path.replace

    def replace(self, target):
        if Path(target).name == three[number].name:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return original(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    if not links:
        monkeypatch.setattr(os, "link", no_links)
    with pytest.raises(
        CrfDeblurError, match=rf"{three[number].name}: cannot be written \(No space"
    ):
        write_all(three)
    assert everything(tmp_path) == before
    assert not list(tmp_path.rglob(f"{PREFIX}*"))


def no_links(*_arguments, **_options):
    raise OSError(errno.EPERM, os.strerror(errno.EPERM))


def test_what_cannot_be_put_back_is_kept_and_named(three, monkeypatch):
    def broken(original):
        def move(self, target):
            if Path(target) == three[0]:
                raise OSError(errno.EIO, os.strerror(errno.EIO))
            return original(self, target)

        return move

    monkeypatch.setattr(os, "link", no_links)
    monkeypatch.setattr(Path, "rename", broken(Path.rename))
    monkeypatch.setattr(Path, "replace", broken(Path.replace))
    with pytest.raises(CrfDeblurError, match="put it back") as raised:
        write_all(three)
    kept = Path(str(raised.value).split("before is ")[1].removesuffix(": put it back"))
    assert kept.read_text() == "old a"


@pytest.mark.parametrize("fails", [False, True])
def test_a_folder_is_replaced_as_a_whole(tmp_path, fails):
    path = tmp_path / "data.zarr"
    path.mkdir()
    (path / "old").write_text("old")
    (tmp_path / "x.txt").write_text("old")

    def write():
        planned = [Output(path, ANY, folder=True), Output(tmp_path / "x.txt", ANY)]
        with Outputs([], planned) as outputs:
            place = outputs[path]
            assert place.suffix == ".zarr"
            place.mkdir()
            (place / "new").write_text("new")
            write_text(outputs[tmp_path / "x.txt"], "new")
            if fails:
                raise CrfDeblurError("no more")

    if fails:
        with pytest.raises(CrfDeblurError, match="no more"):
            write()
        assert everything(tmp_path) == {path / "old": "old", tmp_path / "x.txt": "old"}
    else:
        write()
        assert everything(tmp_path) == {path / "new": "new", tmp_path / "x.txt": "new"}


def test_what_was_not_written_stays(three):
    with Outputs([], [Output(path, ANY) for path in three]) as outputs:
        write_text(outputs[three[1]], "new b")
    assert [path.read_text() for path in three] == ["old a", "new b", "old c"]


def test_a_writer_names_the_output_and_not_what_is_beside_it(three):
    def fail():
        with Outputs([], [Output(path, ANY) for path in three]) as outputs:
            raise CrfDeblurError(f"{outputs[three[1]]}: cannot be written (full)")

    with pytest.raises(CrfDeblurError) as raised:
        fail()
    assert str(raised.value) == f"{three[1]}: cannot be written (full)"


def test_folders_are_made_and_taken_away_if_the_run_fails(tmp_path):
    folder = tmp_path / "a" / "b"
    planned = [Output(folder / "x.txt", ANY)]

    def run(failure=None):
        with Outputs([], planned, [folder]) as outputs:
            write_text(outputs[folder / "x.txt"], "new")
            if failure:
                raise failure

    with pytest.raises(KeyboardInterrupt):
        run(KeyboardInterrupt())
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(CrfDeblurError, match="kind of file"):
        enter([*planned, Output(folder / "x.doc", (".txt",))], [folder])
    assert list(tmp_path.iterdir()) == []
    run()
    assert everything(tmp_path) == {folder / "x.txt": "new"}
    with pytest.raises(KeyboardInterrupt):
        run(KeyboardInterrupt())
    assert everything(tmp_path) == {folder / "x.txt": "new"}


def test_an_output_that_is_known_late_is_held_apart_too(three, photo):
    with Outputs([photo], [Output(three[0], ANY)]) as outputs:
        for path in (photo, three[0]):
            with pytest.raises(CrfDeblurError, match="by this run"):
                outputs.add(Output(path, ANY))
        outputs.add(Output(three[1], ANY))
        write_text(outputs[three[1]], "late")
    assert three[1].read_text() == "late"


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such permission bits")
def test_the_mask_of_the_process_is_heeded_and_never_changed(three, monkeypatch):
    old = os.umask(0o027)
    try:
        monkeypatch.setattr(os, "umask", lambda _mask: pytest.fail("the mask was changed"))
        write_all(three)
        assert three[1].stat().st_mode & 0o777 == 0o640
    finally:
        monkeypatch.undo()
        os.umask(old)
