"""Reading what a run leaves."""

import json
import re

import numpy as np
import pytest

import starlings

POSTERIOR = """parameter,unit,transform,estimate,sd,lo95,hi95,mean_transformed,cov:k,cov:c
k,N/m,log,40.25,0.5,39.0,41.0,3.69,0.0001,-2e-5
c,N s/m,log,0.75,0.01,0.7,0.8,-0.28,-2e-5,0.0004
"""
SUMMARY = {
    "study": "oscillator",
    "parameters": [
        {"name": "k", "unit": "N/m", "estimate": 40.25, "sd": 0.5, "interval95": [39.0, 41.0]},
        {"name": "c", "unit": "N s/m", "estimate": 0.75, "sd": 0.01, "interval95": [0.7, 0.8]},
    ],
    "correlation": [[1.0, -0.1], [-0.1, 1.0]],
    "warnings": ["short"],
}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "posterior.csv").write_text(POSTERIOR)
    (tmp_path / "summary.json").write_text(json.dumps(SUMMARY))
    return tmp_path


def test_a_run_is_read(folder):
    run = starlings.read_run(folder)
    assert run.names == ["k", "c"]
    assert run["c"]["interval95"] == [0.7, 0.8]
    assert np.array_equal(run.covariance, [[1e-4, -2e-5], [-2e-5, 4e-4]])
    assert np.array_equal(run.correlation, [[1.0, -0.1], [-0.1, 1.0]])
    assert run.warnings == ["short"]
    with pytest.raises(KeyError, match="no parameter `q`"):
        run["q"]


def test_without_pandas_the_table_is_of_arrays(folder, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    table = starlings.read_run(folder).parameters
    assert table["estimate"].tolist() == [40.25, 0.75]
    assert table["parameter"].tolist() == ["k", "c"]


def test_a_unit_that_is_a_number_stays_text(folder):
    (folder / "posterior.csv").write_text(POSTERIOR.replace("N/m", "1").replace("N s/m", "1"))
    assert list(starlings.read_run(folder).parameters["unit"]) == ["1", "1"]


def test_with_pandas_the_table_has_one_row_per_parameter(folder):
    pytest.importorskip("pandas")
    table = starlings.read_run(folder).parameters
    assert table.loc["c", "estimate"] == 0.75
    assert table.loc["k", "unit"] == "N/m"


def test_with_xarray_the_covariance_has_names(folder):
    pytest.importorskip("xarray")
    table = starlings.read_run(folder).covariance_table()
    assert float(table.sel({"parameter": "k", "with": "c"})) == -2e-5


def test_a_folder_of_no_run_says_what_it_lacks(tmp_path):
    with pytest.raises(FileNotFoundError, match="it lacks summary.json"):
        starlings.read_run(tmp_path)


def test_draws_are_saved_and_read_back_to_the_last_bit(folder, tmp_path):
    run = starlings.read_run(folder)
    drawn = run.draws(50, seed=2)
    saved = starlings.read(run.save(tmp_path / "draws.csv", draws=50, seed=2))
    for name in ("k", "c"):
        assert np.array_equal(np.asarray(saved[name]), np.asarray(drawn[name]))
    with pytest.raises(ValueError, match="as .nc, .parquet or .csv"):
        run.save(tmp_path / "draws.mat")


def test_draws_are_saved_as_parquet(folder, tmp_path):
    pytest.importorskip("pyarrow")
    run = starlings.read_run(folder)
    saved = starlings.read(run.save(tmp_path / "draws.parquet", draws=50, seed=2))
    assert np.array_equal(np.asarray(saved["k"]), np.asarray(run.draws(50, seed=2)["k"]))


def test_a_page_in_a_notebook_may_save_its_figures_and_nothing_else(folder):
    run = starlings.read_run(folder)
    assert run._repr_html_() == f"<p>{folder / 'report.html'} is not there</p>"
    run.report.write_text("<p>a figure</p>")
    (allowed,) = re.findall(r' sandbox="([^"]*)"', run._repr_html_())
    assert set(allowed.split()) == {"allow-scripts", "allow-popups", "allow-downloads"}
