"""What README and pages show works as it stands: commands parse, missions fly, linked files are there."""

import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Final

import click
import pytest

from tests.clients.forked_process import flightstack_done
from tests.documented_commands import commands_in, parse

ROOT: Final = Path(__file__).parents[1]
DOCS: Final = ROOT / "docs"
README: Final = (ROOT / "README.md").read_text(encoding="utf-8")
EXTENDING: Final = (DOCS / "extending.md").read_text(encoding="utf-8")
PAGES: Final = (ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted(DOCS.rglob("*.md")))
README_BYTES: Final = 10_000


def code_blocks(text: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


SQUARE, RECEIVER = code_blocks(README)
REPORTING, HEADINGS = code_blocks(EXTENDING)
COMMANDS = [line for page in PAGES for line in commands_in(page.read_text(encoding="utf-8"))]
LINKS = [
    (page.relative_to(ROOT).as_posix(), link)
    for page in PAGES
    for link in re.findall(r"\]\(([^)h][^)]*)\)", page.read_text(encoding="utf-8"))
]


@pytest.mark.parametrize("line", sorted(set(COMMANDS)))
def test_commands_parse(line: str) -> None:
    parse(line)


def test_there_are_commands() -> None:
    assert len(commands_in(README)) > 8
    assert len(commands_in((DOCS / "cli.md").read_text(encoding="utf-8"))) > 30
    with pytest.raises(click.UsageError):
        parse("flightstack fly lissajous --no-such-option")


def test_the_two_lines_set_up_what_they_use() -> None:
    flight, tests = re.findall(r"^python3\.11 -m venv .*$", README, re.MULTILINE)
    assert flight.endswith("flightstack fly lissajous")
    assert "-e '.[test]'" in tests
    assert tests.endswith("-m pytest")


def test_the_readme_is_short() -> None:
    assert len(README.encode()) <= README_BYTES


def fly(mission: str, folder: Path, *arguments: str) -> str:
    """Fly a mission of a page from a file; what it printed."""
    (folder / "mission.py").write_text(mission, encoding="utf-8")
    done = flightstack_done("fly", str(folder / "mission.py"), *arguments, "--out", str(folder / "run"))
    assert done.returncode == 0, done.stderr
    assert (folder / "run" / "track.png").stat().st_size > 10_000
    return done.stdout


def test_the_mission_flies_and_the_estimator_with_it(tmp_path: Path) -> None:
    (tmp_path / "receiver.py").write_text(RECEIVER, encoding="utf-8")
    printed = fly(SQUARE, tmp_path, "--altitude", "15", "--estimator", str(tmp_path / "receiver.py"))
    assert printed.count("battery") == 4
    assert re.search(r"receiver, vehicle 1: \d+ estimates: alt [01]\.\d+ m RMS off autopilot", printed), (
        printed
    )


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.slow
def test_the_mission_of_aircraft_flies(tmp_path: Path, autopilot: str) -> None:
    fly(HEADINGS, tmp_path, "--model", "aerosonde", "--autopilot", autopilot)


@pytest.mark.slow
def test_the_mission_that_reports_flies(tmp_path: Path) -> None:
    assert re.search(r"^1[12]\.\d V in hover$", fly(REPORTING, tmp_path), re.MULTILINE)


@pytest.mark.slow
def test_the_code_of_the_python_page_runs(tmp_path: Path) -> None:
    """The blocks stand alone; the second one reads the log of the first."""
    printed = []
    for code in code_blocks((DOCS / "python.md").read_text(encoding="utf-8")):
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        printed.append(done.stdout)
    flight, replayed, stepped = printed
    assert flight.startswith("completed ")
    assert re.search(r"truth \['roll [01]\.\d\d deg', 'pitch [01]\.\d\d deg'\]", replayed), replayed
    assert re.fullmatch(r"[1-9]\d{3,} bytes in 2 s of vehicle time\n", stepped)


@pytest.mark.parametrize(("page", "link"), LINKS, ids=lambda text: text)
def test_linked_files_and_sections_exist(page: str, link: str) -> None:
    name, _, section = link.partition("#")
    file = (ROOT / page).parent / name if name else ROOT / page
    assert file.exists(), link
    if section:
        headings = re.findall(r"^#+ (.+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
        assert section in {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in headings}


def test_the_index_names_every_page() -> None:
    """The pages of MAVLink services have an index of their own."""
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    pages = [page.relative_to(DOCS).as_posix() for page in sorted(DOCS.rglob("*.md"))]
    expected = [page for page in pages if page != "index.md" and not page.startswith("mavlink")]
    assert len(expected) > 10
    assert [page for page in expected if f"]({page})" not in index] == []


@cache
def modules() -> dict[str, Path]:
    """Every module of the repository, by its full name."""
    tops = ("flightsim", "autopilot_bridge", "estimators", "missions", "tests", "benchmarks", "examples")
    names = {
        path: path.relative_to(ROOT).with_suffix("") for top in tops for path in (ROOT / top).rglob("*.py")
    }
    return dict.fromkeys(tops, ROOT / "pyproject.toml") | {
        ".".join(name.parts).removesuffix(".__init__"): path for path, name in names.items()
    }


def unknown_names(text: str, known: dict[str, Path]) -> list[str]:
    """Modules, names in modules and source files that a page names and that do not exist."""
    unknown = []
    tops = "|".join(sorted({name.partition(".")[0] for name in known}))
    for dotted in re.findall(rf"(?<![\w/.(])(?:{tops})(?:\.(?!md\b|py\b)[A-Za-z]\w*)+", text):
        parts = dotted.split(".")
        depth = max(k for k in range(1, len(parts) + 1) if ".".join(parts[:k]) in known)
        module = known[".".join(parts[:depth])]
        stub = module.with_suffix(".pyi")  # of a package whose names are imported when they are used
        source = "".join(file.read_text(encoding="utf-8") for file in (module, stub) if file.exists())
        known_start = any(name.startswith(dotted) for name in known)  # `missions.studies.lissajous_*`
        if parts[depth:] and not known_start and not re.search(rf"\b{parts[depth]}\b", source):
            unknown.append(dotted)
    paths = [f"/{path.relative_to(ROOT).as_posix()}" for path in known.values()]
    files = re.findall(r"`([\w/]+/\w+\.py)`", text)
    return unknown + [file for file in files if not any(path.endswith(f"/{file}") for path in paths)]


OBJECTS: Final = frozenset({"flight", "vehicle", "wire"})
"""Folders and modules of a package whose name is mostly an object's or a file's: `vehicle.latest`."""
ENDINGS: Final = "json|md|npz|png|py|tif|tlog|toml"


def unknown_short_names(text: str, known: dict[str, Path]) -> list[str]:
    """As `unknown_names`, of names without the package: `commander.guidance`."""
    packages: dict[str, list[str]] = {}
    for package, room in {tuple(name.split(".")[:2]) for name in known if "." in name}:
        packages.setdefault(room, []).append(package)
    rooms = "|".join(sorted(packages.keys() - OBJECTS))
    names = re.findall(rf"`((?:{rooms})(?:\.(?!(?:{ENDINGS})\b)[A-Za-z]\w*)+)`", text)
    return [
        name
        for name in names
        if all(unknown_names(f"{package}.{name}", known) for package in packages[name.partition(".")[0]])
    ]


@pytest.mark.parametrize("page", PAGES)
def test_pages_name_modules_that_exist(page: str) -> None:
    """NAME stands for the reader's own. The change log also names what has gone."""
    text = (ROOT / page).read_text(encoding="utf-8")
    short = unknown_short_names(text, modules()) if Path(page).name != "CHANGELOG.md" else []
    assert [name for name in unknown_names(text, modules()) + short if "NAME" not in name] == []


def test_the_test_sees_names_that_do_not_exist() -> None:
    text = "`estimators.runner.Runner`, `estimators.runer.Runner`, `missions/fly.py`, `missions/errors.py`"
    assert unknown_names(text, modules()) == ["estimators.runer.Runner", "missions/fly.py"]
    short = "`runner.Runner`, `telemetry.no_module`, `flight.tlog`, `commander.guidance`, `commander.Nothing`"
    assert unknown_short_names(short, modules()) == ["telemetry.no_module", "commander.Nothing"]
