"""Dialects by name and from definition files, and the units of their fields."""

import contextlib
import io
import math
from pathlib import Path

import pymavlink.dialects.v20
import pytest
from pymavlink.generator import mavparse

from autopilot_bridge.mavlink.missing_messages import MESSAGES
from estimators.logs import LogError, open_log
from estimators.logs.dialect import dialect_names, load_dialect
from estimators.logs.units import SI, to_si
from estimators.logs.xml_definitions import read_definitions
from tests.estimators.logs.reference import build, tlog

FOLDER = Path(pymavlink.dialects.v20.__path__[0])
XML = sorted(FOLDER.glob("*.xml"))

OWN = """<?xml version="1.0"?>
<mavlink>
  <include>base.xml</include>
  <messages>
    <message id="180000" name="TEST_LEAF">
      <description>Bits &amp; bobs</description>
      <field type="uint8_t" name="id" instance="true">Which</field>
      <field type="int16_t" name="bend" units="cdeg">How far</field>
      <field type="float[3]" name="force">All of it</field>
      <field type="char[8]" name="label">Name</field>
      <extensions/>
      <field type="uint64_t" name="time_usec" units="us">When</field>
    </message>
  </messages>
</mavlink>
"""
BASE = """<mavlink><messages>
  <message id="0" name="HEARTBEAT">
    <field type="uint8_t" name="type"/><field type="uint8_t" name="autopilot"/>
    <field type="uint8_t" name="base_mode"/><field type="uint32_t" name="custom_mode"/>
    <field type="uint8_t" name="system_status"/>
    <field type="uint8_t_mavlink_version" name="mavlink_version"/>
  </message>
</messages></mavlink>
"""


@pytest.mark.parametrize("path", XML, ids=lambda path: path.stem)
def test_definition_files_as_pymavlink_parses_them(path):
    with contextlib.redirect_stdout(io.StringIO()):
        theirs = mavparse.MAVXML(str(path), mavparse.PROTOCOL_2_0)
    ours = {item.message_id: item for item in read_definitions(path)[0]}
    for item in theirs.message:
        found = ours[item.id]
        assert (found.name, found.crc_extra) == (item.name, item.crc_extra)
        assert [field.name for field in found.fields] == item.fieldnames
        assert [(f.name, f.type, f.length) for f in found.wire_order] == [
            (f.name, f.type, f.array_length) for f in item.ordered_fields
        ]
        assert [f"[{field.units}]" if field.units else "" for field in found.fields] == [
            field.units for field in item.fields
        ]


@pytest.mark.parametrize("name", ["all", "ardupilotmega", "common", "minimal"])
def test_a_file_and_its_generated_dialect_are_the_same(name):
    by_name, by_file = load_dialect(name), load_dialect(FOLDER / f"{name}.xml")
    added = MESSAGES.keys() if name == "all" else set()  # pymavlink's own files have them not
    assert by_name.messages.keys() - added == by_file.messages.keys()
    for key in by_file.messages:
        found = by_name.messages[key]
        other = by_file.messages[key]
        assert found.instance_field == other.instance_field
        assert dict(found.units) == dict(other.units)
        assert found.definition.wire_fields == other.definition.wire_fields
        assert found.made is other.made or by_name.name != "all"


@pytest.fixture
def own(tmp_path):
    (tmp_path / "own.xml").write_text(OWN)
    (tmp_path / "base.xml").write_text(BASE)
    return tmp_path / "own.xml"


def test_log_in_a_dialect_of_the_users_own(own, tmp_path):
    dialect = load_dialect(str(own))
    leaf = dialect.find("test_leaf").definition
    assert [field.name for field in leaf.wire_fields] == ["force", "bend", "id", "label", "time_usec"]
    assert (leaf.size, leaf.message_id) == (31, 180000)
    payload = leaf.wire.pack(1.0, 2.0, 3.0, -4500, 7, b"oak", 3_000_000)
    items = [build(180000, payload, crc_extra=leaf.crc_extra), build(0, bytes([0] * 8 + [3]))]
    path = tmp_path / "a.tlog"
    path.write_bytes(tlog(items))
    table = open_log(path, dialect=own).table("TEST_LEAF", instance=7)
    assert table["force"].tolist() == [[1.0, 2.0, 3.0]]
    assert table.si("bend")[0] == pytest.approx(-math.pi / 4)
    assert (table["label"].tolist(), table.time_us.tolist()) == ([b"oak"], [3_000_000])
    ((time_us, message),) = open_log(path, dialect=str(own)).messages("TEST_LEAF")
    assert (time_us, message.name, message.label, message.force) == (  # type: ignore[attr-defined]
        3_000_000,
        "TEST_LEAF",
        "oak",
        (1.0, 2.0, 3.0),
    )
    # Without it the message is not known, but it is there.
    (unknown,) = open_log(path).source.unknown
    assert (unknown.message_id, unknown.count) == (180000, 1)


def test_dialects_by_name(tmp_path):
    assert {"all", "common", "ardupilotmega", "minimal"} <= set(dialect_names())
    path = tmp_path / "a.tlog"
    path.write_bytes(tlog([build(0, bytes(9)), build(30, bytes(28)), build(0, bytes(9))]))
    log = open_log(path, dialect="minimal")
    assert len(log) == 2
    assert [(item.message_id, item.count) for item in log.source.unknown] == [(30, 1)]


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("nosuch", None, "no MAVLink dialect 'nosuch'; accepted: .*ardupilotmega.* path of an .xml"),
        ("gone.xml", None, "the dialect .*gone.xml can't be read: No such file"),
        ("bad.xml", "<mavlink><messages>", "is not XML"),
        ("bad.xml", "\0", "is not XML"),
        ("bad.xml", "<xhtml/>", "begins with <xhtml>"),
        ("bad.xml", "<mavlink/>", "defines no message"),
        ("bad.xml", "<mavlink><include>gone.xml</include></mavlink>", "the dialect .*gone.xml can't be read"),
        ("bad.xml", '<mavlink><messages><message name="A" id="x"/></messages></mavlink>', "an id in 0"),
        (
            "bad.xml",
            '<mavlink><messages><message name="A" id="1"><field name="b" type="uint7_t"/></message>'
            "</messages></mavlink>",
            "field b of type 'uint7_t'; accepted",
        ),
        (
            "bad.xml",
            '<mavlink><messages><message name="A" id="1"><field name="b" type="double[40]"/></message>'
            "</messages></mavlink>",
            "payload of 320 bytes",
        ),
        (
            "bad.xml",
            '<mavlink><messages><message name="A" id="1"><field name="b" type="char"/></message>'
            '<message name="B" id="1"><field name="b" type="char"/></message></messages></mavlink>',
            "clash",
        ),
        (
            "bad.xml",
            '<mavlink><messages><message name="A" id="1"><field name="b" type="char"/>'
            '<field name="b" type="char"/></message></messages></mavlink>',
            "a field twice",
        ),
        (
            "bad.xml",
            '<mavlink><messages><message name="A" id="1"><field name="_b" type="char"/></message>'
            "</messages></mavlink>",
            "message A: .*underscore.*rename it",
        ),
    ],
)
def test_dialects_that_are_none(tmp_path, name, content, words):
    path = tmp_path / name
    if content is not None:
        path.write_text(content)
    with pytest.raises(LogError, match=words):
        load_dialect(path if name.endswith(".xml") else name)


def test_files_that_include_each_other_are_read_once(tmp_path):
    (tmp_path / "a.xml").write_text(BASE.replace("<messages>", "<include>b.xml</include><messages>"))
    (tmp_path / "b.xml").write_text("<mavlink><include>a.xml</include></mavlink>")
    assert len(read_definitions(tmp_path / "a.xml")[0]) == 1


def test_units_of_every_definition_are_known():
    plain = {"pix", "dB", "dBm"}
    for found in load_dialect("all").messages.values():
        assert set(found.units.values()) <= SI.keys() | plain


@pytest.mark.parametrize(
    ("unit", "value", "si", "si_unit"),
    [
        ("degE7", 473_977_420, math.radians(47.397742), "rad"),
        ("cdeg", 9000, math.pi / 2, "rad"),
        ("mrad/s", 1500, 1.5, "rad/s"),
        ("rpm", 60, 2 * math.pi, "rad/s"),
        ("mG", 1000, 9.80665, "m/s^2"),
        ("mm", -1500, -1.5, "m"),
        ("cm/s", 250, 2.5, "m/s"),
        ("ms", 20, 0.02, "s"),
        ("us", 20, 2e-5, "s"),
        ("hPa", 1013.25, 101325.0, "Pa"),
        ("mgauss", 500, 5e-5, "T"),
        ("gauss", 0.5, 5e-5, "T"),
        ("c%", 5000, 0.5, ""),
        ("cdegC", 2150, 21.5, "degC"),
        ("mV", 12600, 12.6, "V"),
        ("cA", 1234, 12.34, "A"),
        ("mAh", 1000, 3600.0, "C"),
        ("", 3, 3.0, ""),
        ("furlong", 3, 3.0, "furlong"),
    ],
)
def test_units(unit, value, si, si_unit):
    factor, name = to_si(unit)
    assert value * factor == pytest.approx(si)
    assert name == si_unit


def test_an_include_that_is_not_there_may_be_one_of_pymavlinks(tmp_path):
    path = tmp_path / "mine.xml"
    path.write_text(
        "<mavlink><include>common.xml</include><messages><message id='8' name='MY_LINK'>"
        "<field type='uint64_t' name='stamp' units='ms'>x</field></message></messages></mavlink>"
    )
    dialect = load_dialect(path)
    assert list(dialect.messages) == sorted({*load_dialect("common").messages, 8})
    assert dialect.find("MY_LINK").definition.size == 8
    path.write_text(path.read_text().replace("common.xml", "no_such.xml"))
    with pytest.raises(LogError, match=r"no_such\.xml can't be read: No such file"):
        load_dialect(path)
