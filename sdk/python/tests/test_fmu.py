"""FMUs of both versions, built here. Needs fmpy; pythonfmu for FMI 2, a C compiler for FMI 3."""

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import starlings
from served import Process, floats, numbers
from starlings import _solver_pb2 as pb

fmpy = pytest.importorskip("fmpy")
HERE = Path(__file__).resolve().parent

DECAY = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="decay" instantiationToken="1" description="A state that decays.">
  <CoSimulation modelIdentifier="decay" canHandleVariableCommunicationStepSize="{variable}"/>
  <UnitDefinitions><Unit name="1/s"/><Unit name="m"/></UnitDefinitions>
  <TypeDefinitions><Float64Type name="Length" unit="m"/></TypeDefinitions>
  <DefaultExperiment stepSize="0.5"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="k" valueReference="1" causality="parameter" variability="tunable" start="2" unit="1/s" min="0"/>
    <Float64 name="u[1]" valueReference="2" causality="input" start="0"/>
    <Float64 name="x" valueReference="3" causality="local" initial="{initial}" {start} declaredType="Length"/>
    <Float64 name="der(x)" valueReference="4" causality="local" derivative="3"/>
    <Float64 name="y" valueReference="5" causality="output" declaredType="Length" description="What is seen."/>
  </ModelVariables>
  <ModelStructure><Output valueReference="5"/><ContinuousStateDerivative valueReference="4"/></ModelStructure>
</fmiModelDescription>
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The shared library of decay_fmi3.c, with an empty function for everything else that fmpy looks for."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    source = (HERE / "decay_fmi3.c").read_text()
    own = set(re.findall(r"\b(fmi3\w+)\(", source))
    wanted = set(re.findall(r"def (fmi3[A-Z]\w+)\(", Path(fmpy.__file__).with_name("fmi3.py").read_text()))
    folder = tmp_path_factory.mktemp("decay")
    empty = "".join(f"int {name}(void) {{ return 0; }}\n" for name in sorted(wanted - own))
    (folder / "decay.c").write_text(source + empty)
    out = folder / "decay.so"
    subprocess.run([compiler, "-shared", "-fPIC", "-o", out, folder / "decay.c", "-lm"], check=True)
    return out


def fmi3(library, folder, initial="exact", variable="true"):
    path = folder / "decay.fmu"
    start = 'start="1"' if initial == "exact" else ""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", DECAY.format(initial=initial, start=start, variable=variable))
        archive.write(library, f"binaries/{fmpy.platform_tuple}/decay.so")
    return str(path)


@pytest.fixture(scope="module")
def tanks(tmp_path_factory):
    """The FMU of the example, FMI 2."""
    builder = pytest.importorskip("pythonfmu.builder")
    folder = tmp_path_factory.mktemp("tanks")
    example = HERE.parents[2] / "examples" / "fmu" / "tanks.py"
    builder.FmuBuilder.build_FMU(example, dest=folder)
    return str(folder / "Tanks.fmu")


def test_an_fmu_of_version_3_says_what_it_is_with_units(library, tmp_path):
    from starlings.fmu import Fmu
    from starlings.solver import Served

    served = Served(Fmu(fmi3(library, tmp_path)))
    (k,) = served.parameters.quantities
    assert (k.name, k.unit, k.lo, k.hi, k.default) == ("k", "1/s", 0.0, None, 2.0)
    assert [(q.name, q.unit) for q in served.states.quantities] == [("x", "m")]
    assert [(q.name, q.unit, q.says) for q in served.outputs.quantities] == [("y", "m", "What is seen.")]
    # A bracket would mean a component of a field.
    assert served.inputs.names() == ["u_1"]
    assert served.restart and served.says == "A state that decays."


def test_an_fmu_of_version_3_runs_and_starts_again(library, tmp_path):
    from starlings.fmu import Fmu

    fmu = Fmu(fmi3(library, tmp_path))
    times = np.linspace(0.0, 2.0, 5)
    drive = {"u_1": ([0.0, 2.0], [3.0, 3.0])}
    whole = starlings.simulate(fmu, parameters={"k": 1.5}, times=times, inputs=drive, initial={"x": 4.0})
    # A held input is exact in this FMU: rounding.
    assert np.allclose(whole.outputs["y"], 2.0 + 2.0 * np.exp(-1.5 * times), rtol=1e-14, atol=0)
    first = starlings.simulate(fmu, parameters={"k": 1.5}, times=times[:3], inputs=drive, initial={"x": 4.0})
    rest = starlings.simulate(
        fmu, parameters={"k": 1.5}, times=times[3:], start=times[2], inputs=drive, state=first.state
    )
    both = np.concatenate([first.outputs["y"], rest.outputs["y"]])
    assert both.tobytes() == whole.outputs["y"].tobytes()
    assert rest.state.tobytes() == whole.state.tobytes()


def test_states_that_cannot_be_set_make_an_fmu_that_cannot_restart(library, tmp_path):
    from starlings.fmu import Fmu
    from starlings.solver import Served

    path = fmi3(library, tmp_path, initial="calculated")
    assert not Served(Fmu(path)).restart
    with pytest.raises(starlings.DeclarationError, match="`x` cannot be set before a run"):
        Fmu(path, states=["x"])
    with pytest.raises(starlings.DeclarationError, match="no real variable `q`"):
        Fmu(path, states=["q"])


def test_an_fmu_of_fixed_steps_refuses_times_between_them(library, tmp_path):
    from starlings.fmu import Fmu

    fmu = Fmu(fmi3(library, tmp_path, variable="false"))
    drive = {"u_1": ([0.0, 0.3, 2.0], [3.0, 3.0, 3.0])}
    whole = starlings.simulate(fmu, parameters={"k": 1.5}, times=[1.0], inputs=drive)
    assert whole.outputs["y"][0] == pytest.approx(2.0 - np.exp(-1.5), rel=1e-14)
    with pytest.raises(starlings.Failed, match="in steps of 0.5 only, and 0.0 to 0.7 is not a whole number"):
        starlings.simulate(fmu, parameters={"k": 1.5}, times=[0.7], inputs=drive)


def test_a_failed_run_of_an_fmu_does_not_spoil_the_next(library, tmp_path):
    from starlings.fmu import Fmu

    fmu = Fmu(fmi3(library, tmp_path))
    drive = {"u_1": ([0.0], [0.0])}
    good = starlings.simulate(fmu, parameters={"k": 1.5}, times=[1.0], inputs=drive)
    # 0 * infinity: the FMU goes on with what is no number.
    with pytest.raises(starlings.Failed, match="output `y`"):
        starlings.simulate(fmu, parameters={"k": 0.0}, times=[1.0], inputs=drive)
    again = starlings.simulate(fmu, parameters={"k": 1.5}, times=[1.0], inputs=drive)
    assert again.state.tobytes() == good.state.tobytes()


def test_an_fmu_of_version_2_is_served_from_the_command_line(tanks, tmp_path):
    script = tmp_path / "tanks.py"
    script.write_text("from starlings.fmu import main\n\nmain()\n")
    process = Process(script, tmp_path, arguments=[tanks, "--states", "h1,h2", "--step", "1"])
    try:
        said = process.describe()
        assert (said.name, said.restart) == ("Tanks", True)
        assert [(q.name, q.default_value) for q in said.parameters] == [("k1", 10.0), ("k2", 10.0)]

        def ask(start, times, state=None):
            reply = process.run(
                pb.RunRequest(
                    parameters=floats(12.0, 9.0),
                    start=start,
                    times=floats(*times),
                    outputs=["level1", "level2"],
                    observed=floats(*[np.nan] * 2 * len(times)),
                    inputs=[pb.Signal(times=floats(0.0, 40.0), values=floats(20.0, 60.0))],
                    state=state,
                )
            )
            return reply.finished

        whole = ask(0.0, [10.0, 20.0, 30.0])
        first = ask(0.0, [10.0, 20.0])
        rest = ask(20.0, [30.0], first.state)
        assert first.outputs + rest.outputs == whole.outputs
        assert rest.state == whole.state
        assert numbers(whole.state).tolist() == numbers(whole.outputs)[-2:].tolist()
    finally:
        process.close()


def test_what_is_no_fmu_is_told_in_one_line(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "starlings.fmu", str(tmp_path / "nothing.fmu")],
        cwd=HERE.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1 and "this FMU cannot be served" in done.stderr


def test_an_fmu_is_unpacked_where_the_worker_removes_it_when_its_program_is_killed(library, tmp_path):
    script = tmp_path / "decay.py"
    script.write_text("from starlings.fmu import main\n\nmain()\n")
    given, worker, system = (tmp_path / name for name in ("given", "worker", "system"))
    for folder in (given, worker, system):
        folder.mkdir()
    chosen = {"STARLINGS_SOLVER_SOCKET": str(worker / "s"), "TMPDIR": str(system)}
    process = Process(script, tmp_path, environment=chosen, arguments=[fmi3(library, given)])
    try:
        assert process.describe().name == "decay"
        process.child.kill()
    finally:
        process.close()
    assert list(worker.glob("*/modelDescription.xml")), "beside the socket"
    assert list(system.iterdir()) == [], "nothing in the folder of the system"
