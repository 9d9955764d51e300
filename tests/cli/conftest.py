"""A folder with small inputs, in which the command runs."""

import shutil

import pytest
from small_runs import make_inputs


@pytest.fixture(scope="session")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    make_inputs(folder)
    return folder


@pytest.fixture
def here(tmp_path, monkeypatch, inputs):
    """A copy of the inputs, in which the command runs."""
    shutil.copytree(inputs, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path
