"""The files a JSBSim model is made of: where they are, and a copy that opens no port and writes no file.

A model names other files (engines, propellers, systems) by the attribute `file`. JSBSim searches them beside
the model and in the folders of its root; in its own layout a model is `ROOT/aircraft/NAME/NAME.xml`, with
`ROOT/engine` and `ROOT/systems` for all.
"""

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from flightsim.airframe import Airframe, AirframeError
from flightsim.foundation.documents import read_xml
from flightsim.foundation.file_content import FileError
from flightsim.jsbsim_package import jsbsim

_ENGINES: Final = frozenset({"engine", "thruster"})
_SYSTEMS: Final = frozenset({"system", "autopilot", "flight_control"})
_IN_AND_OUT: Final = ("input", "output")
"""Children of a model's root that let JSBSim listen on a port for commands, send data to hosts, and write
files. The elements of the same names inside channels are signals of the control system.
"""
_MOST_FILES: Final = 256
"""Of one model; the largest of the jsbsim package has 15."""


@dataclass(frozen=True, slots=True)
class ModelFile:
    """One file of a model.

    Attributes:
        path: where it is.
        name: name of its copy; other files refer to it by this name.
        root: its XML, with the names of the copies.
    """

    path: Path
    name: str
    root: ElementTree.Element


def model_files(airframe: Airframe) -> tuple[ModelFile, ...]:
    """The model's XML, without the elements for input and output, and every file that it names, recursively.

    A file is searched in the places and in the order of JSBSim: beside the model, in its folders for engines
    and systems, in those of its root, and in those of the `jsbsim` package.

    Raises:
        AirframeError: a file that is named is in none of these places, or can't be read.
    """
    files = [ModelFile(airframe.xml_path, airframe.xml_path.name, _parsed(airframe, airframe.xml_path))]
    for tag in _IN_AND_OUT:
        for element in files[0].root.findall(tag):
            files[0].root.remove(element)
    names = {airframe.xml_path.resolve(): airframe.xml_path.name}
    for file in files:  # grows while it is read
        for element in _references(file.root):
            path = _found(airframe, element, file.path)
            key = path.resolve()
            if key not in names:
                if len(names) == _MOST_FILES:
                    raise AirframeError(f"{airframe.xml_path} names more than {_MOST_FILES} files")
                # different folders may have files of one name
                names[key] = path.name if path.name not in names.values() else f"{len(names)}-{path.name}"
                files.append(ModelFile(path, names[key], _parsed(airframe, path)))
            element.set("file", names[key])
    return tuple(files)


def write_copy(airframe: Airframe, folder: Path, change: Callable[[ElementTree.Element], None]) -> None:
    """Write the files of a model into an empty folder, all beside each other.

    Args:
        airframe: the model.
        folder: where to.
        change: changes the root of the model's own XML before it is written.

    Raises:
        AirframeError: as `model_files`.
    """
    files = model_files(airframe)
    change(files[0].root)
    for file in files:
        (folder / file.name).write_bytes(ElementTree.tostring(file.root))


def content_digest(airframe: Airframe) -> str:
    """A digest of the contents of all these files: it changes when one of them does."""
    digest = hashlib.blake2b(digest_size=16)
    for path in sorted(file.path for file in model_files(airframe)):
        data = path.read_bytes()
        digest.update(f"{path}\0{len(data)}\0".encode())
        digest.update(data)
    return digest.hexdigest()


def refusal(airframe: Airframe, reasons: list[str]) -> str:
    """Message of a model that can't be loaded."""
    detail = "; ".join(" ".join(reason.split()) for reason in reasons) or "no reason given"
    return f"JSBSim cannot load {airframe.xml_path}: {detail}"


def _references(root: ElementTree.Element) -> Iterator[ElementTree.Element]:
    return (element for element in root.iter() if element.get("file"))


def _found(airframe: Airframe, element: ElementTree.Element, named_in: Path) -> Path:
    """The file that an element names."""
    name = element.get("file", "")
    folders = _folders(airframe, element.tag)
    for folder in folders:
        for path in (folder / name, folder / f"{name}.xml"):
            if path.is_file():
                return path
    places = ", ".join(str(folder) for folder in folders)
    raise AirframeError(
        refusal(
            airframe, [f"{named_in.name} names the {element.tag} file '{name}', which is in none of {places}"]
        )
    )


def _folders(airframe: Airframe, tag: str) -> list[Path]:
    own = airframe.folder
    folders = [own]
    for tags, inside, beside in (
        (_ENGINES, ("Engines", "engine"), "engine"),
        (_SYSTEMS, ("Systems", "systems"), "systems"),
    ):
        if tag in tags:
            folders += [own / name for name in inside]
            if own.parent.name == "aircraft":
                folders.append(own.parent.parent / beside)
            folders.append(Path(jsbsim.get_default_root_dir()) / beside)
    return folders


def _parsed(airframe: Airframe, path: Path) -> ElementTree.Element:
    try:
        return read_xml(path).getroot()
    except FileError as error:
        raise AirframeError(refusal(airframe, [str(error)])) from None
