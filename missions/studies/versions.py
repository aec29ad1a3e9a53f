"""Versions of the software that computes a study's rows."""

import json
from importlib import metadata
from typing import Final

from missions.flown.run_folder import versions

_ALSO: Final = ("scipy",)


def software_versions() -> str:
    """Names and versions as JSON, the same text for the same software."""
    found = versions()
    found |= {package: metadata.version(package) for package in _ALSO}
    return json.dumps(found, sort_keys=True)
