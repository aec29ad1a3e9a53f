"""The files of a JSBSim model: where they are found, what is left out, and the reasons of refusals."""

import re
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import jsbsim
import pytest

import flightsim
from flightsim.airframe import Airframe, AirframeError, load_airframe
from flightsim.flight_envelope import flight_envelope
from flightsim.jsbsim_model import load_fdm
from flightsim.model_files import model_files, write_copy

PACKAGE = Path(jsbsim.get_default_root_dir())
MODELS = Path(flightsim.__file__).parent / "models"


def in_jsbsim_layout(root: Path) -> Path:
    """An aircraft in JSBSim's own layout, with an engine and a propeller that only this root has."""
    folder, engines = root / "aircraft/mine", root / "engine"
    folder.mkdir(parents=True)
    engines.mkdir()
    text = (PACKAGE / "aircraft/c172p/c172p.xml").read_text()
    text = re.sub(r'engine file="[^"]*"', 'engine file="my_engine"', text)
    text = re.sub(r'thruster file="[^"]*"', 'thruster file="my_propeller"', text)
    (folder / "mine.xml").write_text(text)
    shutil.copy(PACKAGE / "engine/eng_io320.xml", engines / "my_engine.xml")
    shutil.copy(PACKAGE / "engine/prop_75in2f.xml", engines / "my_propeller.xml")
    return folder


def loads(airframe: Airframe) -> jsbsim.FGFDMExec:
    fdm, _ = load_fdm(airframe, 125)
    return fdm


@pytest.mark.parametrize("name", ["mine.xml", ""], ids=["file", "folder"])
def test_jsbsims_own_layout(tmp_path: Path, name: str) -> None:
    folder = in_jsbsim_layout(tmp_path)
    airframe = load_airframe(folder / name)
    assert {file.path.name for file in model_files(airframe)} == {
        "mine.xml",
        "my_engine.xml",
        "my_propeller.xml",
    }
    assert loads(airframe).get_propulsion().get_num_engines() == 1


def test_a_file_that_is_missing_is_named_with_the_places(tmp_path: Path) -> None:
    folder = in_jsbsim_layout(tmp_path)
    (tmp_path / "engine/my_engine.xml").unlink()
    with pytest.raises(
        AirframeError, match=r"mine\.xml names the engine file 'my_engine', which is in none of"
    ) as info:
        loads(load_airframe(folder))
    assert f"{tmp_path}/engine" in str(info.value) and str(PACKAGE / "engine") in str(info.value)


def free_port() -> int:
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        return int(server.getsockname()[1])


@pytest.mark.parametrize("kind", ["multicopter", "fixed_wing"])
def test_a_model_opens_no_port_and_writes_no_file(tmp_path: Path, kind: str) -> None:
    """`<input port>` opens a property console on all networks, `<output name>` writes any file."""
    port, victim = free_port(), tmp_path / "victim.csv"
    folder = tmp_path / "model"
    if kind == "multicopter":
        shutil.copytree(MODELS / "iris", folder)
        xml, model = folder / "iris.xml", folder
    else:
        folder.mkdir()
        xml = model = folder / "c172p.xml"
        shutil.copy(PACKAGE / "aircraft/c172p/c172p.xml", xml)
    output = f'<output name="{victim}" type="CSV" rate="10"><simulation>ON</simulation></output>'
    added = f'<input port="{port}"/>{output}</fdm_config>'
    xml.write_text(xml.read_text().replace("</fdm_config>", added))
    fdm = loads(load_airframe(model))
    fdm.run_ic()
    for _ in range(30):
        fdm.run()
    assert not victim.exists()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), timeout=2.0)


def test_only_named_files_are_copied(tmp_path: Path) -> None:
    """A model in a folder with thousands of other files."""
    folder = in_jsbsim_layout(tmp_path)
    for number in range(50):
        (folder / f"other{number}.xml").write_text("<other/>")
    copy = tmp_path / "copy"
    copy.mkdir()
    write_copy(load_airframe(folder), copy, lambda _root: None)
    assert sorted(path.name for path in copy.iterdir()) == ["mine.xml", "my_engine.xml", "my_propeller.xml"]


def test_messages_name_the_users_file_and_no_line_of_the_copy(tmp_path: Path) -> None:
    xml = in_jsbsim_layout(tmp_path) / "mine.xml"
    xml.write_text(xml.read_text().replace("fcs/flap-cmd-norm", "fcs/missing-property"))
    with pytest.raises(
        AirframeError, match=rf"cannot load {xml}: mine\.xml: .*fcs/missing-property does not exist"
    ):
        loads(load_airframe(xml))


@pytest.mark.parametrize(
    ("control", "unit"), [("elevator", "fcs/elevator-cmd-norm"), ("aileron", "fcs/aileron-cmd-norm")]
)
def test_a_control_that_is_not_wired_is_measured(tmp_path: Path, control: str, unit: str) -> None:
    """The reason is what the control does, not a guess about the wing."""
    text = (MODELS / "aerosonde/aerosonde.xml").read_text()
    text = re.sub(rf"{unit}(\[0\])?", f"fcs/other-{control}", text)
    text = re.sub(
        r"(<flight_control[^>]*>)", rf'\1<property value="0.0">fcs/other-{control}</property>', text, count=1
    )
    path = tmp_path / "unwired.xml"
    path.write_text(text)
    words = rf"the {control} moves nothing: commands of -0\.5 and 0\.5 at .* written to {unit}"
    with pytest.raises(AirframeError, match=words):
        flight_envelope(path)


def test_models_are_loaded_in_threads_that_end() -> None:
    """JSBSim holds a thread's logger until the thread is gone, and gives it up without Python's lock."""
    code = (
        "from threading import Thread; from flightsim.airframe import load_airframe;"
        "from flightsim.jsbsim_model import load_fdm;"
        "threads = [Thread(target=load_fdm, args=(load_airframe('iris'), 250)) for _ in range(4)];"
        "[thread.start() for thread in threads]; [thread.join() for thread in threads]"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
