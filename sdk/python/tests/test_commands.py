"""The commands from Python, on the real program: STARLINGS_PROGRAM, or the one that is installed."""

import os
import shutil
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

import starlings
from starlings.program import program

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


def _has_program():
    try:
        program()
    except starlings.RunError:
        return False
    return True


pytestmark = pytest.mark.skipif(not _has_program(), reason="the program `starlings` is not here: name it in STARLINGS_PROGRAM")


def cooling(t, start, rate, room=20.0):
    print("solvers may print")
    return room + start * np.exp(-rate * t)


def cooling_study(**changes):
    t = np.linspace(0.0, 60.0, 61)
    noise = np.random.default_rng(1).normal(0.0, 0.3, t.size)
    data = {"t": t, "temperature": cooling(t, 70.0, 0.05) + noise}
    priors = {"start": starlings.Prior(50, factor=2, unit="K"), "rate": starlings.Prior(0.1, factor=3, unit="1/s")}
    return starlings.study(cooling, data, priors, **{"noise": 0.3, "train": (0, 45), **changes})


@pytest.fixture(scope="module")
def cooled(tmp_path_factory):
    return starlings.run(cooling_study(), out=tmp_path_factory.mktemp("run") / "cooling", workers=2)


def test_a_function_and_arrays_come_to_a_posterior(cooled):
    for name, truth in (("start", 70.0), ("rate", 0.05)):
        entry = cooled[name]
        assert abs(entry["estimate"] - truth) < 4.0 * entry["sd"]
    assert list(cooled.parameters["unit"]) == ["K", "1/s"]
    assert (cooled.folder / "study" / "study.toml").is_file()
    assert cooled.report.is_file()
    assert cooled._repr_html_().startswith("<iframe srcdoc=")


def test_the_same_study_gives_the_same_bytes_from_the_saved_file(cooled, tmp_path):
    again = starlings.run(cooled.folder / "study" / "study.toml", out=tmp_path / "again", workers=1)
    posterior = [(run.folder / "posterior.csv").read_bytes() for run in (cooled, again)]
    assert posterior[0] == posterior[1]


def test_draws_reproduce_the_posterior_within_monte_carlo_error(cooled):
    n = 40_000
    z = np.log(np.column_stack([np.asarray(cooled.draws(n, seed=3)[name]) for name in cooled.names]))
    sd = np.sqrt(np.diag(cooled.covariance))
    assert np.all(np.abs(z.mean(axis=0) - cooled.mean) < 5.0 * sd / np.sqrt(n))
    assert np.allclose(np.corrcoef(z.T), cooled.correlation, atol=5.0 / np.sqrt(n))


def test_the_posterior_is_saved_as_netcdf_that_arviz_reads(cooled, tmp_path):
    arviz = pytest.importorskip("arviz")
    saved = arviz.from_netcdf(str(cooled.save(tmp_path / "posterior.nc", draws=400)))
    drawn = cooled.to_arviz(draws=400)
    for name in cooled.names:
        assert np.array_equal(saved.posterior[name].values, drawn.posterior[name].values)


def test_the_summary_of_arviz_is_that_of_the_run(cooled):
    arviz = pytest.importorskip("arviz")
    data = cooled.to_arviz(draws=8000)
    assert dict(data.posterior.sizes)["chain"] == 4
    summary = arviz.summary(data, round_to="none")
    for name in cooled.names:
        error = 5.0 * cooled[name]["sd"] / np.sqrt(8000)
        assert abs(summary.loc[name, "mean"] - cooled[name]["estimate"]) < error
        assert abs(summary.loc[name, "sd"] / cooled[name]["sd"] - 1.0) < 0.06
    observed = data.observed_data["data:temperature"].to_numpy()
    assert observed.shape == (61,)
    assert int(data.constant_data["data:temperature:fitted"].sum()) == 46


def test_predictive_draws_and_log_likelihoods_are_those_of_the_model_and_of_the_summary(cooled):
    arviz = pytest.importorskip("arviz")
    data = cooled.to_arviz(draws=4000, predictive=True)
    channel = "data:temperature"
    t = data.log_likelihood[f"{channel}:fitted_time"].to_numpy()
    observed = data.observed_data[channel].to_numpy()
    likelihood = data.log_likelihood[channel].to_numpy().reshape(4000, -1)
    drawn = {name: data.posterior[name].to_numpy().reshape(4000, 1) for name in cooled.names}
    exact = cooling(t, drawn["start"], drawn["rate"])
    by_hand = -0.5 * ((observed - exact) / 0.3) ** 2 - np.log(0.3 * np.sqrt(2.0 * np.pi))
    # What is left is of second order: posterior sd of a few per mille of a prediction of 70 K, squared, over the noise.
    assert np.abs(likelihood.sum(axis=1) - by_hand.sum(axis=1)).max() < 0.1
    # The mean over draws: that of the estimate, by the error of the summary, less half of what the parameters cost.
    error = next(c for c in cooled.summary["fit"]["channels"] if c["name"] == channel or c["name"] == "temperature")
    of_estimate = -0.5 * len(t) * (error["train_rmse"] / 0.3) ** 2 - len(t) * np.log(0.3 * np.sqrt(2.0 * np.pi))
    # Two parameters, both determined by the data alone: half a unit each; its Monte-Carlo error is 1/sqrt(4000).
    assert abs(likelihood.sum(axis=1).mean() - (of_estimate - 1.0)) < 0.1
    predictive = data.posterior_predictive[channel].to_numpy().reshape(4000, -1)
    assert np.allclose(predictive.mean(axis=0), exact.mean(axis=0), atol=6.0 * 0.33 / np.sqrt(4000))
    assert np.allclose(predictive.std(axis=0) ** 2, 0.09 + exact.std(axis=0) ** 2, rtol=0.15)
    assert np.isfinite(arviz.loo(data).elpd_loo)
    again = cooled.to_arviz(draws=4000, predictive=True)
    assert np.array_equal(again.posterior_predictive[channel].to_numpy().reshape(4000, -1), predictive)


def test_a_forecast_and_the_tables(cooled):
    found = cooled.forecast(until=120.0, levels=["temperature<25"], members=50)
    assert found.levels[0]["probability"] == 1.0
    assert abs(found.levels[0]["median"] - np.log(70.0 / 5.0) / 0.05) < 2.0
    assert len(found.fan["time"]) > 0
    assert len(cooled.table("predictions")["time"]) == 61


def test_check_identify_and_twin(tmp_path):
    study = cooling_study()
    assert starlings.check(study).result["study"] == "cooling"
    assert "reasonable" in starlings.identify(study).advice
    one = starlings.twin(study, {"rate": 0.07, "start": 70.0})
    assert np.allclose(one["temperature"], 20.0 + 70.0 * np.exp(-0.07 * np.asarray(one["time"])), rtol=1e-12)


def test_overrides_reach_a_study_in_a_file_and_leave_nothing_beside_it(tmp_path):
    before = sorted(os.listdir(EXAMPLES / "rcr"))
    run = starlings.run(EXAMPLES / "rcr" / "study.toml", out=tmp_path / "out", study={"seed": 5, "name": "other"})
    assert (run.summary["seed"], run.summary["study"]) == (5, "other")
    assert sorted(os.listdir(EXAMPLES / "rcr")) == before


def test_an_explanation_names_its_effect_and_its_study_is_sound(tmp_path):
    found = starlings.explain(EXAMPLES / "pig-aorta" / "explain-ex-vivo.toml", out=tmp_path / "why")
    assert (found.verdict, found.effects) == ("named", ["series-resistance"])
    assert "series-resistance" in found.headline
    fitted = np.asarray(found.gap["use"]) == "train"
    assert np.all(np.asarray(found.gap["after"])[fitted] < np.asarray(found.gap["before"])[fitted])
    assert found.study is not None
    assert starlings.check(found.study).result["study"]


def test_drift_and_noise_of_a_twin(tmp_path):
    for name in ("study.toml", "truth.toml", "start.csv"):
        shutil.copy(EXAMPLES / "lorenz" / name, tmp_path)
    path = starlings.twin(tmp_path / "truth.toml", options=["--until", "8", "--step", "0.002"])
    columns = {key: np.asarray(path[key]) for key in path}
    np.savetxt(tmp_path / "data.csv", np.column_stack(list(columns.values())), "%.17g", ",", header=",".join(columns), comments="")
    found = starlings.infer(tmp_path / "study.toml", out=tmp_path / "drift", workers=1)
    table = {key: np.asarray(found.coefficients[key]) for key in found.coefficients}
    k = list(table["name"]).index("a33")
    assert abs(table["estimate"][k] + 8.0 / 3.0) < 4.0 * table["sd"][k]
    assert table["observed"][k] and not table["may_be_zero"][k]
    assert found._repr_html_().startswith("<iframe")
    ahead = found.forecast(until=8.2, step=0.01, levels=["x1>1000"], members=20, workers=1)
    assert ahead.levels[0]["probability"] == 0.0
    assert np.isclose(np.asarray(ahead.fan["time"]).max(), 8.2)


def test_a_diagnosis_names_what_struck_the_nozzle(tmp_path):
    found = starlings.diagnose(EXAMPLES / "thrust-vector-control" / "diagnose.toml", out=tmp_path / "nozzle", workers=2)
    assert (found.verdict, found.named) == ("named", ["blow"])
    # The blow begins at 0.1 s; a record holds 500 values per second.
    assert found.since is not None and 0.09 < found.since < 0.12
    table = found.scenarios.reset_index() if hasattr(found.scenarios, "reset_index") else found.scenarios
    k = list(table["name"]).index("blow")
    # The data were made with 1.25 times the blow of the library.
    assert abs(table["severity"][k] - 1.25) < 4.0 * table["severity_sd"][k]
    assert table["severity_lo90"][k] < table["severity"][k] < table["severity_hi90"][k]
    assert bool(table["explains"][k]) and table["probability"][k] > 0.99
    assert {"blow", "ring", "push"} == set(found.parameters["scenario"])
    assert found.says and not found.warnings
    assert found._repr_html_().startswith("<iframe")


def test_a_wrong_study_names_its_places():
    with pytest.raises(starlings.StudyError) as error:
        starlings.check(cooling_study(estimator={"kind": "kalman"}))
    (problem,) = error.value.problems
    assert problem["line"] > 1 and "kalman" in problem["message"]


def test_a_function_that_fails_says_so_with_its_line(tmp_path):
    def broken(t, start):
        raise RuntimeError("no convergence")

    study = starlings.study(broken, {"t": [0.0, 1.0], "y": [1.0, 2.0]}, {"start": starlings.Prior(1, factor=2)}, noise=0.1)
    with pytest.raises(starlings.StudyError, match="no convergence"):
        starlings.run(study, out=tmp_path / "out")


def test_a_function_that_ends_the_process_is_a_failure_and_hangs_nothing(tmp_path):
    def leaves(t, start):
        sys.exit(3)

    study = starlings.study(leaves, {"t": [0.0, 1.0], "y": [1.0, 2.0]}, {"start": starlings.Prior(1, factor=2)}, noise=0.1)
    with pytest.raises(starlings.StudyError, match="the model ended the process by sys.exit"):
        starlings.run(study, out=tmp_path / "out")


def test_a_folder_that_is_taken_is_refused(cooled):
    with pytest.raises(starlings.StudyError, match=r"already(.|\n)*starlings\.run\(\.\.\., out='.*', resume=True\)"):
        starlings.run(cooled.folder / "study" / "study.toml", out=cooled.folder)


SLOW = """
import time
import numpy as np
import starlings

def slow(t, rate):
    time.sleep(0.3)
    return np.exp(-rate * t)

t = np.linspace(0, 1, 5)
study = starlings.study(slow, {"t": t, "y": np.exp(-t)}, {"rate": starlings.Prior(3, factor=2)}, noise=1e-6)
print("begins", flush=True)
try:
    starlings.run(study, out="out", workers=2, estimator={"max_iterations": 30, "tolerance": 1e-9})
except KeyboardInterrupt as error:
    print("interrupted", error, flush=True)
"""


def _started(folder):
    script = folder / "slow.py"
    script.write_text(textwrap.dedent(SLOW))
    path = str(Path(__file__).resolve().parent.parent)
    child = subprocess.Popen(
        [sys.executable, str(script)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, "STARLINGS_PROGRAM": program()},
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # A shell starts what it puts into the background with Ctrl-C ignored, and the tests with it.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert child.stdout.readline() == "begins\n"
    deadline = time.monotonic() + 60.0
    # The script, the program, two workers and their solvers.
    while not (folder / "out" / "run.db").is_file() or len(_below(folder)) < 5:
        assert time.monotonic() < deadline, "no worker came"
        time.sleep(0.05)
    return child


def _below(folder):
    """Processes whose current folder or command lies in `folder`."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdecimal() and str(folder) in f"{(entry / 'environ').read_bytes()!r}{os.readlink(entry / 'cwd')}":
                found.append(int(entry.name))
        except OSError:
            continue
    return [pid for pid in found if pid != os.getpid()]


def _gone(folder):
    deadline = time.monotonic() + 30.0
    while _below(folder):
        assert time.monotonic() < deadline, f"still there: {_below(folder)}"
        time.sleep(0.05)


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks at processes in /proc")
def test_ctrl_c_ends_everything_that_was_started(tmp_path):
    child = _started(tmp_path)
    os.kill(child.pid, signal.SIGINT)
    said = child.communicate(timeout=60)[0]
    assert said == "interrupted what was computed so far is in out: starlings.run(..., out='out', resume=True) goes on\n"
    _gone(tmp_path)
    assert (tmp_path / "out" / "run.db").is_file()


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks at processes in /proc")
def test_a_kernel_that_is_killed_leaves_nothing_behind(tmp_path):
    child = _started(tmp_path)
    child.kill()
    child.wait()
    _gone(tmp_path)
