"""The files a JSBSim model is made of."""

import hashlib
import re
from pathlib import Path
from typing import Final

import jsbsim

from flightsim.airframe import Airframe

_FILE: Final = re.compile(rb"""\bfile\s*=\s*["']([^"']+)["']""")
_OWN_FOLDERS: Final = ("", "Engines", "engine", "Systems", "systems")


def model_files(airframe: Airframe) -> tuple[Path, ...]:
    """The model's XML and every file it names (engines, propellers, systems, tables), recursively.

    A file is searched in the same places as in JSBSim: beside the model, in its folders for engines and
    systems, and in those of the `jsbsim` package; all matches are included.
    """
    package = Path(jsbsim.get_default_root_dir())
    folders = (*(airframe.folder / name for name in _OWN_FOLDERS), package / "engine", package / "systems")
    found: dict[Path, None] = {}
    waiting = [airframe.xml_path]
    while waiting:
        path = waiting.pop()
        if path in found or not path.is_file():
            continue
        found[path] = None
        for name in _FILE.findall(path.read_bytes()):
            text = name.decode("utf-8", "replace")
            waiting += [folder / spelled for folder in folders for spelled in (text, f"{text}.xml")]
    return tuple(found)


def content_digest(airframe: Airframe) -> str:
    """A digest of the contents of all these files: it changes when one of them does."""
    digest = hashlib.blake2b(digest_size=16)
    for path in sorted(model_files(airframe)):
        data = path.read_bytes()
        digest.update(f"{path}\0{len(data)}\0".encode())
        digest.update(data)
    return digest.hexdigest()
