"""Recordings in memory: what is taken as numbers over time, and what is refused with its place."""

import datetime

import numpy as np
import pytest

from starlings.recording import RecordingError, by_name, take


def refused(data, **named):
    with pytest.raises(RecordingError) as error:
        take(data, "tank", **named)
    return str(error.value)


def test_a_table_of_arrays_keeps_every_bit_and_its_gaps():
    values = [0.1 + 0.2, np.nan, 1e-300]
    text = take({"t": [0, 1, 2.5], "T": values}, "tank").csv()
    assert text == "t,T\n0.0,0.30000000000000004\n1.0,\n2.5,1e-300\n"


def test_times_are_found_by_their_name_or_named():
    assert take({"time": [0, 1], "y": [1, 2]}, "a").time == "time"
    assert take({"s": [0, 1], "y": [1, 2]}, "a", "s").time == "s"
    assert "no column named time or t" in refused({"s": [0, 1], "y": [1, 2]})
    assert "has no column `x`; there are s, y" in refused({"s": [0, 1], "y": [1, 2]}, time="x")


def test_none_is_a_gap_and_other_objects_are_refused_by_row():
    taken = take({"t": [0, 1, 2], "y": np.array([1.5, None, 2], dtype=object)}, "a")
    assert np.array_equal(taken.columns["y"], [1.5, np.nan, 2.0], equal_nan=True)
    assert "column `y` holds 'n/a' in row 1" in refused({"t": [0, 1], "y": np.array([1.5, "n/a"], dtype=object)})
    assert "expected numbers" in refused({"t": [0, 1], "y": ["1.5", "2"]})
    assert "expected numbers" in refused({"t": [0, 1], "y": [True, False]})


def test_times_must_increase_and_be_there():
    assert "does not increase in row 2" in refused({"t": [0, 1, 1], "y": [1, 2, 3]})
    assert "has no value in row 1" in refused({"t": [0, np.nan], "y": [1, 2]})
    assert "has no rows" in refused({"t": [], "y": []})


def test_lengths_and_infinite_values():
    assert "different lengths" in refused({"t": [0, 1], "y": [1, 2, 3]})
    assert "infinite in row 1" in refused({"t": [0, 1], "y": [1, np.inf]})


def test_what_is_no_table_is_refused():
    assert "is a ndarray" in refused(np.zeros(3))


def test_several_recordings_have_names():
    table = {"t": [0, 1], "y": [1, 2]}
    assert list(by_name(table)) == ["data"]
    assert list(by_name([table, table])) == ["record-1", "record-2"]
    assert list(by_name({"monday": table})) == ["monday"]


def test_a_frame_gives_its_index_and_dates_become_seconds():
    pandas = pytest.importorskip("pandas")
    zone = datetime.timezone(datetime.timedelta(hours=2))
    stamps = pandas.to_datetime(["2024-03-01 10:00:00", "2024-03-01 10:00:30"]).tz_localize(zone)
    taken = take(pandas.DataFrame({"y": [1.0, 2.0]}, index=stamps), "a")
    assert taken.time == "time"
    assert taken.columns["time"].tolist() == [0.0, 30.0]
    plain = pandas.DataFrame({"time": pandas.to_datetime(["2024-03-01", "2024-03-02"]), "y": [1, 2]})
    assert take(plain, "a").columns["time"].tolist() == [0.0, 86400.0]
    spans = pandas.DataFrame({"time": pandas.to_timedelta([1, 2], unit="min"), "y": [1, 2]})
    assert take(spans, "a").columns["time"].tolist() == [60.0, 120.0]
    gaps = pandas.DataFrame({"time": [0, 1], "y": pandas.array([1, None], dtype="Int64")})
    assert np.isnan(take(gaps, "a").columns["y"][1])
    twice = pandas.DataFrame([[0, 1, 2]], columns=["t", "y", "y"])
    assert "two columns are named `y`" in refused(twice)
