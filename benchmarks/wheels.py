"""Whether the dependencies resolve from wheels alone on the systems that are named in docs/systems.md.

Before a release: `python -m benchmarks.wheels` asks uv, which needs the package index but installs nothing.
Exit code 1: a system lacks a wheel; uv's reason is printed.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path

PROJECT = Path(__file__).parents[1] / "pyproject.toml"
# name, uv's platform, the macOS that its wheels may need at most
SYSTEMS = (
    ("Linux x86-64", "x86_64-unknown-linux-gnu", ""),
    ("Linux ARM64", "aarch64-unknown-linux-gnu", ""),
    ("Windows x86-64", "x86_64-pc-windows-msvc", ""),
    ("macOS 13 Intel", "x86_64-apple-darwin", "13.0"),
    ("macOS 13 Apple", "aarch64-apple-darwin", "13.0"),
    ("macOS 15 Intel", "x86_64-apple-darwin", "15.0"),
    ("macOS 15 Apple", "aarch64-apple-darwin", "15.0"),
)
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
WITHOUT = {("macOS 13 Intel", "3.14")}  # OpenCV's wheels for it want a NumPy that has none for Python 3.14


def resolved(platform: str, macos: str, python: str, extras: list[str]) -> subprocess.CompletedProcess[str]:
    """uv's answer: the pinned packages, or why there is none."""
    command = [sys.executable, "-m", "uv", "pip", "compile", "--quiet", "--only-binary", ":all:"]
    command += ["--python-platform", platform, "--python-version", python, str(PROJECT)]
    command += [part for extra in extras for part in ("--extra", extra)]
    if macos == "15.0":  # uv's macOS has no `platform_release`, by which the marker finds it
        command.append("-")
    environment = {**os.environ, **({"MACOSX_DEPLOYMENT_TARGET": macos} if macos else {})}
    return subprocess.run(
        command, capture_output=True, text=True, input="mavsdk>=4.1", env=environment, check=False
    )


def main() -> int:
    """Print a table of the systems and Python versions."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--extra", action="append", default=[], help="extra to resolve too")
    extras = parser.parse_args().extra
    failed = False
    for name, platform, macos in SYSTEMS:
        for python in (python for python in PYTHONS if (name, python) not in WITHOUT):
            done = resolved(platform, macos, python, extras)
            names = {line.partition("==")[0] for line in done.stdout.splitlines() if "==" in line}
            absent = [package for package in ("jsbsim", "mavsdk") if package not in names]
            words = f"{len(names)} packages" + (f", without {' and '.join(absent)}" if absent else "")
            if done.returncode:
                failed, words = True, f"NO: {' '.join(done.stderr.split())}"
            sys.stdout.write(f"{name:15} Python {python}: {words}\n")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
