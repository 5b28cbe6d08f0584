"""Tables in files of other formats: the numbers that another library wrote come back, to the last bit."""

import numpy as np
import pytest

import starlings
from starlings.recording import take

T = np.linspace(0.0, 1.0, 11)
Y = np.sin(T) / 3.0


def columns(found):
    return {name: np.asarray(found[name]) for name in found}


def same(found):
    found = columns(found)
    assert set(found) == {"t", "y"}
    np.testing.assert_array_equal(found["t"], T)
    np.testing.assert_array_equal(found["y"], Y)


def test_parquet_and_feather(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import feather, parquet

    written = pyarrow.table({"t": T, "y": Y})
    parquet.write_table(written, tmp_path / "a.parquet")
    feather.write_feather(written, str(tmp_path / "a.feather"))
    same(starlings.read(tmp_path / "a.parquet"))
    same(starlings.read(tmp_path / "a.feather"))


def test_the_name_of_a_file_does_not_decide(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    parquet.write_table(pyarrow.table({"t": T, "y": Y}), tmp_path / "a.csv")
    same(starlings.read(tmp_path / "a.csv"))


def test_netcdf_of_the_classic_format(tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    with scipy_io.netcdf_file(str(tmp_path / "a.nc"), "w") as file:
        file.createDimension("t", len(T))
        file.createDimension("place", 2)
        for name, values in (("t", T), ("y", Y)):
            file.createVariable(name, "d", ("t",))[:] = values
        file.createVariable("field", "d", ("t", "place"))[:] = 0.0
    same(starlings.read(tmp_path / "a.nc"))


def test_times_of_netcdf_that_count_hours_from_a_date_become_seconds(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file["time"] = np.arange(3.0) + 1000.0
        file["time"].attrs["units"] = "hours since 2020-01-01 00:00:00"
        file["y"] = np.array([1, -999, 3], dtype=np.int16)
        file["y"].attrs.update({"scale_factor": 0.5, "_FillValue": np.int16(-999)})
    found = columns(starlings.read(tmp_path / "a.nc"))
    np.testing.assert_array_equal(found["time"], [0.0, 3600.0, 7200.0])
    np.testing.assert_array_equal(found["y"], [0.5, np.nan, 1.5])


def test_hdf5_groups_are_named(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run1/t"], file["run1/y"] = T, Y
    with pytest.raises(starlings.RecordingError, match="group=; there are run1"):
        starlings.read(tmp_path / "a.h5")
    with pytest.raises(starlings.RecordingError, match="no group `run2`; there are run1"):
        starlings.read(tmp_path / "a.h5", group="run2")
    same(starlings.read(tmp_path / "a.h5", group="run1"))


def test_matlab_of_both_kinds(tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(tmp_path / "a.mat", {"t": T[:, None], "y": Y[None, :], "note": "text", "one": 1.0})
    same(starlings.read(tmp_path / "a.mat"))
    scipy_io.savemat(tmp_path / "b.mat", {"rig": {"t": T, "y": Y}})
    same(starlings.read(tmp_path / "b.mat", group="rig"))
    h5py = pytest.importorskip("h5py")
    # What MATLAB 7.3 writes: HDF5 behind a block of its own, vectors as matrices.
    with h5py.File(tmp_path / "c.mat", "w", userblock_size=512) as file:
        file["t"], file["y"] = T[None, :], Y[None, :]
        file["note"] = np.array([[116], [101]], dtype=np.uint16)
        file["note"].attrs["MATLAB_class"] = np.bytes_("char")
    with open(tmp_path / "c.mat", "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(128))
    same(starlings.read(tmp_path / "c.mat"))


def test_csv_is_read_where_it_is_clean_and_refused_with_the_remedy_where_not(tmp_path):
    (tmp_path / "a.csv").write_text("t,y\n" + "".join(f"{t!r},{y!r}\n" for t, y in zip(T.tolist(), Y.tolist())))
    same(starlings.read(tmp_path / "a.csv"))
    (tmp_path / "b.csv").write_text("t;y\n0,5;1\n")
    with pytest.raises(starlings.RecordingError, match="starlings init b.csv"):
        starlings.read(tmp_path / "b.csv")


def test_a_study_takes_the_path_of_such_a_file(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    parquet.write_table(pyarrow.table({"t": T, "y": Y}), tmp_path / "a.parquet")
    found = take(str(tmp_path / "a.parquet"), "data")
    assert found.time == "t" and found.measured == ["y"]
    parquet.write_table(pyarrow.table({"x": T, "y": Y}), tmp_path / "b.parquet")
    with pytest.raises(starlings.RecordingError, match="no column named time or t: name the one that holds the time with time="):
        take(tmp_path / "b.parquet", "data")


def test_what_is_no_table_is_told(tmp_path):
    (tmp_path / "a.bin").write_bytes(b"\x00\x01\x02")
    with pytest.raises(starlings.RecordingError, match="no format that is known"):
        starlings.read(tmp_path / "a.bin")
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(tmp_path / "a.mat", {"field": np.zeros((3, 4)), "one": 1.0})
    with pytest.raises(starlings.RecordingError, match="no one-dimensional variable; there are field, one"):
        starlings.read(tmp_path / "a.mat")


def test_a_file_that_is_damaged_is_no_table(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    whole, cut, late, empty = (tmp_path / name for name in ("a.parquet", "b.parquet", "c.parquet", "d.csv"))
    parquet.write_table(pyarrow.table({"t": T, "y": Y}), whole)
    cut.write_bytes(whole.read_bytes()[:-40])
    late.write_bytes(whole.read_bytes()[40:].replace(b"\x00", b" "))
    empty.write_bytes(b"")
    with pytest.raises(starlings.RecordingError, match=r"b\.parquet cannot be read, and may be damaged or cut off: write it again \("):
        starlings.read(cut)
    with pytest.raises(starlings.RecordingError, match=r"c\.parquet does not begin as a \.parquet file does, and may be damaged"):
        take(late, "data")
    with pytest.raises(starlings.RecordingError, match=r"d\.csv is empty"):
        starlings.read(empty)
    (tmp_path / "e.parquet").write_bytes(b"")
    with pytest.raises(starlings.RecordingError, match=r"e\.parquet does not begin"):
        starlings.read(tmp_path / "e.parquet")
