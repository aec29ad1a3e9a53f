"""Other tools read what a log was exported to, and find the same values."""

import json

import numpy as np
import pytest
from mcap.reader import make_reader
from pyarrow import csv, parquet

from autopilot_bridge.mavlink import FrameEncoder, dialect
from estimators.logs import LogError, open_log
from estimators.logs.arrow import name_in_si
from estimators.logs.export import FORMATS, export
from estimators.logs.new_file import new_file
from tests.estimators.logs.flight_log import RATE_HZ, SECONDS, write
from tests.estimators.logs.reference import EPOCH_US

COUNT = SECONDS * RATE_HZ


@pytest.fixture
def log(tmp_path):
    return open_log(write(tmp_path / "flight.tlog"))


def test_parquet_has_columns_units_and_texts(log, tmp_path):
    written = export(log, log.select(), tmp_path / "out", "parquet")
    assert {path.name for path in written} == {
        *("ATTITUDE_1_1.parquet", "ATTITUDE_2_1.parquet", "GPS_RAW_INT_1_1.parquet", "HEARTBEAT_1_1.parquet"),
        *("RAW_IMU_1_1.parquet", "STATUSTEXT_1_1.parquet", "SERVO_OUTPUT_RAW_1_1.parquet"),
    }
    table = parquet.read_table(tmp_path / "out" / "ATTITUDE_1_1.parquet")
    assert np.array_equal(table["roll"].to_numpy(), log.table("ATTITUDE", system_id=1)["roll"])
    assert table["time_us"][0].as_py() == 5_000_000 and table["log_time_us"][0].as_py() == EPOCH_US
    assert table.schema.field("roll").metadata == {b"unit": b"rad"}
    assert table.schema.metadata[b"message"] == b"ATTITUDE"
    gps = parquet.read_table(tmp_path / "out" / "GPS_RAW_INT_1_1.parquet")
    assert gps["lat"][0].as_py() == -353600000 and gps.schema.field("lat").metadata == {b"unit": b"degE7"}
    text = parquet.read_table(tmp_path / "out" / "STATUSTEXT_1_1.parquet")
    assert text["text"][3].as_py() == "second 3"


def test_si_units_where_a_field_has_a_unit(log, tmp_path):
    export(log, log.select("GPS_RAW_INT"), tmp_path / "out", "parquet", si=True)
    gps = parquet.read_table(tmp_path / "out" / "GPS_RAW_INT_1_1.parquet")
    assert gps["lat"][0].as_py() == pytest.approx(np.radians(-35.36))
    assert gps["vel"][0].as_py() == pytest.approx(15.0)
    assert gps["fix_type"][0].as_py() == 3
    assert gps.schema.field("vel").metadata == {b"unit": b"m/s"}
    assert gps["time_s"][0].as_py() == pytest.approx(log.table("GPS_RAW_INT")["time_usec"][0] * 1e-6)
    assert "time_usec" not in gps.column_names


@pytest.mark.parametrize(
    ("field", "unit", "name"),
    [
        ("time_boot_ms", "ms", "time_boot_s"),
        ("time_usec", "us", "time_s"),
        ("usec", "us", "s"),
        ("lat", "degE7", "lat"),
        ("rpm", "rpm", "rad_s"),
        ("terms", "", "terms"),
    ],
)
def test_names_in_si_have_the_unit_of_their_values(field, unit, name):
    assert name_in_si(field, unit) == name


def test_csv_in_si_has_units_in_its_headings(log, tmp_path):
    export(log, log.select(["GPS_RAW_INT", "SERVO_OUTPUT_RAW"]), tmp_path / "out", "csv", si=True)
    gps = csv.read_csv(tmp_path / "out" / "GPS_RAW_INT_1_1.csv")
    assert {"time_us", "time_s", "lat [rad]", "vel [m/s]", "fix_type"} <= set(gps.column_names)


def test_csv(log, tmp_path):
    export(log, log.select(["RAW_IMU", "STATUSTEXT"]), tmp_path / "out", "csv")
    imu = csv.read_csv(tmp_path / "out" / "RAW_IMU_1_1.csv")
    assert imu.num_rows == COUNT and imu["zacc [mG]"].to_pylist() == [-1000] * COUNT
    assert imu.column_names[:3] == ["time_us", "log_time_us", "time_usec [us]"]
    assert csv.read_csv(tmp_path / "out" / "STATUSTEXT_1_1.csv")["text"][9].as_py() == "second 9"


def test_npz(log, tmp_path):
    (path,) = export(log, log.select(), tmp_path / "flight.npz", "npz")
    with np.load(path) as arrays:
        assert np.array_equal(arrays["ATTITUDE_2_1/roll"], np.full(COUNT, -0.5, np.float32))
        assert arrays["RAW_IMU_1_1/time_usec"].dtype == np.uint64
        assert arrays["STATUSTEXT_1_1/text"][0] == b"second 0"


def test_mcap(log, tmp_path):
    (path,) = export(
        log, log.select(["ATTITUDE", "STATUSTEXT"], system_id=1), tmp_path / "flight.mcap", "mcap"
    )
    with open(path, "rb") as file:
        found = list(make_reader(file).iter_messages())
    attitude = [
        (message, json.loads(message.data)) for _, channel, message in found if "ATT" in channel.topic
    ]
    assert len(found) == COUNT + SECONDS and len(attitude) == COUNT
    assert attitude[0][0].log_time == EPOCH_US * 1000
    assert attitude[0][0].publish_time == 5_000_000_000
    assert attitude[2][1]["roll"] == pytest.approx(0.02)
    assert attitude[3][1]["pitch"] is None  # NaN
    assert {channel.topic for _, channel, _ in found} == {"/1/1/ATTITUDE", "/1/1/STATUSTEXT"}
    assert {schema.name for schema, _, _ in found} == {"mavlink.ATTITUDE", "mavlink.STATUSTEXT"}


def test_mcap_in_si_units(log, tmp_path):
    """The values and units of `Table.si`; what has no unit stays as it is."""
    names = ["GPS_RAW_INT", "RAW_IMU", "STATUSTEXT"]
    (path,) = export(log, log.select(names, system_id=1), tmp_path / "flight.mcap", "mcap", si=True)
    with open(path, "rb") as file:
        found = [
            (schema, json.loads(message.data)) for schema, _, message in make_reader(file).iter_messages()
        ]
    for name in names[:2]:
        table = log.table(name, system_id=1)
        rows = [row for schema, row in found if schema.name == f"mavlink_si.{name}"]
        for field in table.fields:
            expected = table.si(field) if field in table.units else table[field]
            called = name_in_si(field, table.units.get(field, ""))
            assert [row[called] for row in rows] == expected.tolist(), field
    schema = next(json.loads(item.data) for item, _ in found if item.name == "mavlink_si.GPS_RAW_INT")
    assert schema["properties"]["lat"] == {"type": "number", "description": "rad"}
    assert schema["properties"]["fix_type"] == {"type": "integer"}


@pytest.mark.parametrize("form", FORMATS)
def test_nothing_is_overwritten(log, tmp_path, form):
    target = tmp_path / "out"
    if form in ("csv", "parquet"):
        target.mkdir()
        (target / "mine").write_text("mine")
    else:
        target.write_text("mine")
    with pytest.raises(LogError, match=r"out exists and (is not|nothing is) overwritten"):
        export(log, log.select(), target, form)
    assert (target / "mine" if target.is_dir() else target).read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 2


def test_what_can_not_be_exported(log, tmp_path):
    with pytest.raises(LogError, match="accepted: csv, parquet, npz, mcap"):
        export(log, log.select(), tmp_path / "a", "xlsx")
    with pytest.raises(LogError, match="nothing of"):
        export(log, [], tmp_path / "a", "csv")
    with pytest.raises(LogError, match="can't write"):
        export(log, log.select(), tmp_path / "no" / "such" / "a.npz", "npz")


def test_a_file_is_whole_or_not_there(tmp_path):
    path = tmp_path / "new"
    with pytest.raises(RuntimeError), new_file(path) as part:
        part.write_text("half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(LogError, match="exists"), new_file(path) as part:
        part.write_text("ours")
        path.write_text("another process was faster")
    assert path.read_text() == "another process was faster" and len(list(tmp_path.iterdir())) == 1


def test_files_without_hard_links(tmp_path, monkeypatch):
    """As on a memory card."""

    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr("os.link", refuse)
    path = tmp_path / "new"
    with new_file(path) as part:
        part.write_text("whole")
    assert path.read_text() == "whole" and len(list(tmp_path.iterdir())) == 1
    with pytest.raises(LogError, match="exists"), new_file(tmp_path / "other") as part:
        part.write_text("ours")
        (tmp_path / "other").write_text("another process was faster")
    assert (tmp_path / "other").read_text() == "another process was faster"


def test_mcap_takes_any_time_stamp(tmp_path):
    path = tmp_path / "flight.tlog"
    frame = FrameEncoder(1, 1).encode(dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3))
    stamps = [*range(EPOCH_US, EPOCH_US + 100), 10**17, 2**61 - 1]
    path.write_bytes(b"".join(stamp.to_bytes(8, "big") + frame for stamp in stamps))
    log = open_log(path)
    (written,) = export(log, log.select(), tmp_path / "flight.mcap", "mcap")
    with written.open("rb") as file:
        times = [message.log_time for _, _, message in make_reader(file).iter_messages()]
    assert sorted(times) == [stamp * 1000 for stamp in stamps[:100]] + [2**64 - 1] * 2
