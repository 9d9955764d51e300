"""Arrays of other libraries, and compiled loops, give what numpy gives."""

from importlib import import_module

import numpy as np
import pytest

from napari_crfdeblur import arrays
from napari_crfdeblur.deconvolution import (
    HyperLaplacian,
    LocalShrinkage,
    RichardsonLucy,
    SparseIrls,
    TotalVariation,
    Wiener,
    deconvolve,
    deconvolve_slices,
    loops,
)
from napari_crfdeblur.errors import CrfDeblurError

METHODS = [
    Wiener(),
    RichardsonLucy(5),
    SparseIrls(),
    HyperLaplacian(),
    LocalShrinkage(),
    TotalVariation(),
]
every_method = pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)
LIBRARIES = [pytest.param("torch", marks=pytest.mark.torch), "array_api_strict"]
every_library = pytest.mark.parametrize("library", LIBRARIES, indirect=True)
every_shape = pytest.mark.parametrize(
    ("shape", "psf_shape"), [((40, 51), (7, 5)), ((24, 31, 3), (3, 5)), ((8, 17, 12), (3, 3, 5))]
)


@pytest.fixture
def library(request):
    return import_module(request.param)


def case(shape, psf_shape, dtype=np.float32):
    rng = np.random.default_rng(0)
    return rng.random(shape).astype(dtype), rng.random(psf_shape)


@every_method
@every_library
@every_shape
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_another_library_gives_the_same_on_its_own_arrays(method, library, shape, psf_shape, dtype):
    plane, psf = case(shape, psf_shape, dtype)
    expected = deconvolve(plane, psf, method)
    given = library.asarray(plane)
    found = deconvolve(given, psf, method)
    assert type(found) is type(given)
    assert found.dtype == given.dtype
    # float32 through some 60 transforms by other algorithms; double precision has 1e-9 of that
    tolerance = 2e-5 if dtype is np.float32 else 1e-12
    np.testing.assert_allclose(np.asarray(found), expected, rtol=0, atol=tolerance)
    np.testing.assert_array_equal(np.asarray(given), plane)


@every_method
@every_library
def test_another_library_fills_in_highlights_alike(method, library):
    plane, psf = case((40, 51), (7, 5), np.float64)
    clipped = plane > 0.97
    expected = deconvolve(plane, psf, method, clipped=clipped)
    found = deconvolve(library.asarray(plane), psf, method, clipped=library.asarray(clipped))
    np.testing.assert_allclose(np.asarray(found), expected, rtol=1e-9, atol=1e-9)


@every_library
def test_what_is_wrong_is_refused_alike(library):
    plane, psf = case((20, 30), (3, 5))
    with pytest.raises(CrfDeblurError, match="larger than the image"):
        deconvolve(library.asarray(plane[:2]), psf, Wiener())
    plane[3, 4] = np.nan
    with pytest.raises(CrfDeblurError, match="not finite"):
        deconvolve(library.asarray(plane), psf, Wiener())
    with pytest.raises(ValueError, match="expected a linear image"):
        deconvolve(library.asarray(plane > 0), psf, Wiener())


@every_library
def test_slices_of_another_library(library):
    stack, psf = case((3, 20, 31), (5, 3))
    found = deconvolve_slices(library.asarray(stack), psf, Wiener())
    assert type(found) is type(library.asarray(stack))
    np.testing.assert_allclose(
        np.asarray(found), deconvolve_slices(stack, psf, Wiener()), rtol=0, atol=1e-5
    )


@pytest.mark.parametrize("library", ["numpy", *LIBRARIES], indirect=True)
def test_a_table_is_looked_up_in_its_cells(library):
    table = np.array([3.0, 5.0, 7.0])
    position = library.asarray(np.array([[0.0, 0.9], [1.0, 2.5], [3.0, 1e9]]))
    found = np.asarray(arrays.look_up(table, position))
    np.testing.assert_array_equal(found, [[3, 3], [5, 7], [7, 7]])


@pytest.mark.parametrize(
    "method", [HyperLaplacian(), LocalShrinkage(), TotalVariation(), RichardsonLucy(5)]
)
@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float32, 1e-5), (np.float64, 1e-13)])
def test_compiled_loops_give_the_same(method, dtype, tolerance, monkeypatch):
    pytest.importorskip("numba")
    plane, psf = case((61, 83), (9, 7), dtype)
    plain = deconvolve(plane, psf, method)
    monkeypatch.setattr(loops, "LEAST_SIZE", 0)
    # the compiler may round a product and a sum once instead of twice
    np.testing.assert_allclose(deconvolve(plane, psf, method), plain, rtol=0, atol=tolerance)


def test_without_numba_nothing_is_compiled(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "numba", None)
    loops._compiled.cache_clear()
    monkeypatch.setattr(loops, "LEAST_SIZE", 0)
    assert loops.compiled(loops.divide_inside, np.zeros((3, 4))) is None
    loops._compiled.cache_clear()
