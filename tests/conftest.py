"""What every test run needs: a screen, real or virtual, and settings that are nobody's own."""

import os
import shutil
import sys
from importlib.util import find_spec

import pytest

# napari reads it once, when its settings are imported: keep them in memory.
os.environ["NAPARI_CONFIG"] = ""

# Tests run on all cores, one process each: threads of linear algebra would only wait for cores.
# pytest-xdist's processes and those that tests start inherit it.
os.environ.setdefault("OMP_NUM_THREADS", "1")


@pytest.hookimpl(tryfirst=True)  # before pytest-qt loads Qt, which can abort without a screen
def pytest_configure(config: pytest.Config) -> None:
    if sys.platform != "linux":
        return
    if os.environ.get("QT_QPA_PLATFORM") in ("offscreen", "minimal"):
        raise pytest.UsageError(
            "the tests draw with OpenGL, which QT_QPA_PLATFORM=offscreen lacks: unset it"
        )
    virtual = (
        config.pluginmanager.hasplugin("xvfb")
        and not config.getoption("--no-xvfb")
        and shutil.which("Xvfb")
    )
    if not (virtual or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise pytest.UsageError(
            "the tests open windows, but there is neither a display nor Xvfb with pytest-xvfb: "
            "install them with .ci/display and the package's extra 'test'"
        )


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("torch") and find_spec("torch") is None:
        pytest.skip("torch is missing: run make test-torch")
