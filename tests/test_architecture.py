"""Imports point one way (docs/architecture.md). Read from the sources, so that nothing need be imported."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("flightsim", "autopilot_bridge", "estimators", "missions")
GROUND_FLOOR = tuple(
    f"autopilot_bridge.{name}"
    for name in (
        *("mavlink", "links", "routing", "clock", "tlog", "packet_records", "errors"),
        *("mission_plan", "mission_wire", "mission_feasibility", "fence_shapes"),
        *("parameters", "parameter_files"),
    )
)
FOUNDATION = ("flightsim.foundation",)  # knows nothing of the world: all packages may import it
EARTH_CONSTANTS = (
    *(6378137.0, 6356752.3142, 6371000.0, 6371008.8, 298.257223563, 6.69437999014e-3, 7.292115e-5),
    *(9.80665, 9.7803253359, 8.314462618, 287.05287, 288.15, 273.15, 101325.0, 1013.25, 1.225),
)
LAID_OUT = ("nav", "sp", "setpoint", "truth", "readings")
ANGLE_FUNCTIONS = (
    *("wrap_pi", "wrap_180", "normalize_angle", "euler_of"),
    *("quaternion_from_euler", "euler_from_quaternion", "from_euler", "rotate_inverse", "conjugate"),
)
# What a run flies in: no mission and no estimator may know it.
WORLD = ("flightsim.world_spec", "autopilot_bridge.firmware_process.build")
# The floors of `missions`, from the roof to the ground: rooms (folders and files at its top) import rooms
# of their own floor and of those below.
THE_MISSIONS = (
    *("handoff", "multi_target", "occupancy", "orbit", "pattern_search", "plan_files", "survey"),
    "vision_search",
)
FLOORS = (
    ("__main__", "missions"),  # `missions` itself: the public names
    ("cli",),
    ("studies",),
    ("runs",),
    ("library", "catalogue"),
    THE_MISSIONS,
    ("embedded", "worlds", "estimation", "vehicle_client"),
    ("base", "search"),
    ("flown", "planning", "teams", "preflight"),
    ("vehicle", "patterns"),
    ("view",),
    ("errors", "gps_off", "how_left", "kind", "process"),
)
MOST_LAZY_IMPORTS = 20  # inside functions of `missions`; it goes down only
# Where the wall clock, sockets and files may be met.
CLOCK_AND_LINKS = ("autopilot_bridge.clock", "autopilot_bridge.links")
SANS_IO_FORBIDDEN = ("socket", "select", "selectors", "serial", "asyncio", "threading", "subprocess", "time")
SANS_IO = (
    *(
        f"autopilot_bridge.{name}"
        for name in (
            *("mavlink", "routing"),
            *("mission_plan", "mission_wire", "mission_feasibility", "fence_shapes"),
        )
    ),
    *(
        f"autopilot_bridge.{name}"
        for name in (
            "navigation",
            "control",
            "flight",
            "commander",
            "firmware",
            "services",
            "autopilot",
            "payload",
        )
    ),
)


# These know no firmware: what differs between firmwares is data that `autopilot` hands to them.
KNOW_NO_FIRMWARE = tuple(
    f"autopilot_bridge.{name}"
    for name in (
        *("services", "telemetry", "payload", "storage"),
        *("commander", "control", "flight", "navigation"),
    )
)


def is_in(module, packages):
    return any(module == package or module.startswith(package + ".") for package in packages)


def module_name(path, root=ROOT):
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(source, name, is_package=False):
    """Full names of everything a module imports, anywhere in it; type-checking imports count as well."""
    found = set()
    for node in nodes(source, ast.Import, ast.ImportFrom):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        else:
            base = node.module or ""
            if node.level:
                parts = name.split(".")
                kept = parts[: len(parts) - node.level + (1 if is_package else 0)]
                base = ".".join([*kept, base] if base else kept)
            found.add(base)
            found.update(f"{base}.{alias.name}" for alias in node.names)
    return found


def found_by_module(find, within=PACKAGES, without=()):
    """What a function finds in each module, by its name, where it finds something."""
    found = {name: find(name) for name in MODULES if is_in(name, within) and not is_in(name, without)}
    return {name: wrong for name, wrong in found.items() if wrong}


@cache
def source_of(name):
    return MODULES[name].read_text(encoding="utf-8")


@cache
def nodes(source, *kinds):
    """The nodes of some kinds in a source, in the order of `ast.walk`."""
    if not kinds:
        return list(ast.walk(ast.parse(source)))
    return [node for node in nodes(source) if isinstance(node, kinds)]


MODULES = {module_name(path): path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))}


@cache
def imports_of(name):
    return imported(source_of(name), name, MODULES[name].name == "__init__.py")


def is_embedding(name):
    """Modules of `missions` that may start an embedded SITL, or describe a world."""
    return is_in(name, ("missions.embedded", "missions.worlds", "missions.cli")) or is_world(name)


def is_world(name):
    """Modules of a mission that add to the description of a world what the mission is for."""
    parts = name.split(".")
    return len(parts) > 2 and parts[1] in THE_MISSIONS and parts[2].startswith("world")


def complaints(name, imports):
    """Imports of a module that go against the arrows."""
    ours = {item for item in imports if is_in(item, PACKAGES)}
    if is_in(name, FOUNDATION):
        allowed = FOUNDATION
        forbidden = {
            item for item in imports if is_in(item, ("socket", "time", "pymavlink", "asyncio", "jsbsim"))
        }
    elif is_in(name, ("flightsim",)):
        allowed = ("flightsim",)
        forbidden = {item for item in imports if is_in(item, ("socket", "time", "pymavlink", "asyncio"))}
    elif name == "autopilot_bridge":  # its public names, imported when they are used
        allowed, forbidden = ("autopilot_bridge", *FOUNDATION), set()
    elif is_in(name, GROUND_FLOOR):
        allowed, forbidden = (*GROUND_FLOOR, *FOUNDATION), set()
    elif is_in(name, ("autopilot_bridge",)):
        allowed, forbidden = ("autopilot_bridge", "flightsim"), set()
    elif is_in(name, ("estimators",)):
        allowed, forbidden = ("estimators", *FOUNDATION, *GROUND_FLOOR), set()
    elif is_embedding(name):
        allowed, forbidden = PACKAGES, set()
    else:
        world = WORLD if is_in(name, ("missions.base.request", "missions.runs", "missions.studies")) else ()
        allowed, forbidden = ("missions", "estimators", *FOUNDATION, *GROUND_FLOOR, *world), set()
        # The command line stands above the missions, not below them.
        if name != "missions.__main__":
            forbidden |= {item for item in imports if is_in(item, ("missions.cli",))}
        if not is_in(name, ("missions.runs", "missions.studies")) and name != "missions":
            forbidden |= {item for item in imports if is_world(item)}
    # `from autopilot_bridge import links` names the package and the part; the part is what counts.
    parents = {item.rpartition(".")[0] for item in ours}
    wrong = {item for item in ours if not is_in(item, allowed) and not (item in parents and "." not in item)}
    return sorted(wrong | forbidden)


def imported_from(packages):
    return lambda name: sorted(item for item in imports_of(name) if is_in(item, packages))


def test_imports_point_one_way():
    assert found_by_module(lambda name: complaints(name, imports_of(name))) == {}


def test_cores_do_no_io():
    assert found_by_module(imported_from(SANS_IO_FORBIDDEN), SANS_IO) == {}


def test_firmwares_stand_above_what_they_configure():
    assert found_by_module(imported_from(("autopilot_bridge.firmware",)), KNOW_NO_FIRMWARE) == {}


def flavour_tests(source):
    """Comparisons with the name of a firmware."""
    return [
        ast.unparse(node)
        for node in nodes(source, ast.Compare, ast.match_case)
        for part in ast.walk(node.pattern if isinstance(node, ast.match_case) else node)
        if isinstance(part, ast.Constant) and part.value in ("px4", "ardupilot")
    ]


def test_only_firmware_tests_for_a_firmware():
    """Elsewhere a firmware's difference is data of its `Flavour` or its `SimulatorDefaults`."""
    elsewhere = ("autopilot_bridge",), ("autopilot_bridge.firmware",)
    assert found_by_module(lambda name: flavour_tests(source_of(name)), *elsewhere) == {}


def test_the_test_sees_flavours():
    found = flavour_tests('x = {"px4": 1}\nif spec.autopilot == "ardupilot": pass\ny = z in ("px4",)')
    assert found == ["spec.autopilot == 'ardupilot'", "z in ('px4',)"]


def test_only_the_emulated_backend_reaches_into_the_emulated_autopilot():
    """Another backend has none; what all have is in `AutopilotBackend` and the protocols beside it."""
    users = {
        name
        for name in MODULES
        if is_in(name, ("autopilot_bridge.sitl", "autopilot_bridge.video", "missions", "estimators"))
        for node in nodes(source_of(name), ast.Attribute)
        if node.attr == "commander"
    }
    # the warm-up flies an emulated vehicle to compile what it uses
    assert users == {"autopilot_bridge.sitl.backend", "autopilot_bridge.sitl.warm_up"}


def test_only_clock_and_shells_know_the_wall_clock():
    """`time` is imported by the clock alone; what reports wall time (runners, benchmarks) asks the clock."""
    users = [
        name
        for name in MODULES
        if "time" in {item.split(".")[0] for item in imports_of(name)} and not is_in(name, CLOCK_AND_LINKS)
    ]
    assert users == []


def test_flight_tasks_of_both_classes_of_vehicle_do_not_know_each_other():
    """What both use is in the package above them."""
    one, other = "autopilot_bridge.flight.multicopter", "autopilot_bridge.flight.fixed_wing"
    wrong = [
        (name, item)
        for name in MODULES
        for item in imports_of(name)
        if (is_in(name, (one,)) and is_in(item, (other,))) or (is_in(name, (other,)) and is_in(item, (one,)))
    ]
    assert [name for name in MODULES if is_in(name, (one,))] and wrong == []


def test_kernels_have_the_cache_that_notices_other_modules():
    users = [name for name in MODULES if "numba" in imports_of(name)]
    assert users == ["flightsim.foundation.kernels"]


@cache
def needed(name):
    """The modules of ours that a module imports; `from package import module` needs only the module."""
    found = set()
    for node in nodes(source_of(name), ast.Import, ast.ImportFrom):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        else:
            for alias in node.names:
                module = f"{node.module}.{alias.name}"
                found.add(module if module in MODULES else node.module)
    return (found & MODULES.keys()) - {name}


def in_circles(needs):
    """The modules that need themselves by way of others."""
    left = {name: set(others) for name, others in needs.items()}
    while True:
        used = set().union(*left.values())
        free = {name for name, others in left.items() if not others or name not in used}
        if not free:
            return sorted(left)
        left = {name: others - free for name, others in left.items() if name not in free}


def test_no_modules_import_each_other():
    """Imports in functions and for type checking count."""
    assert in_circles({name: needed(name) for name in MODULES}) == []


def test_the_test_sees_circles():
    assert in_circles({"a": {"b"}, "b": {"c", "d"}, "c": {"b"}, "d": set()}) == ["b", "c"]
    assert in_circles({"a": {"b"}, "b": {"c"}, "c": set()}) == []


def lazy_imports(source):
    """Lines of imports inside functions."""
    return sorted(
        {
            node.lineno
            for function in nodes(source, ast.FunctionDef, ast.AsyncFunctionDef)
            for node in ast.walk(function)
            if isinstance(node, ast.Import | ast.ImportFrom)
        }
    )


def test_missions_import_at_the_top_of_their_modules():
    """A body of a command (`missions.cli.bodies`) is loaded when the command runs, with all that it needs.
    What remains is a library that most runs do without (matplotlib, scikit-learn, PyAV), or a plug-in.
    """
    count = sum(map(len, found_by_module(lambda name: lazy_imports(source_of(name)), ("missions",)).values()))
    assert count <= MOST_LAZY_IMPORTS


def test_the_test_sees_lazy_imports():
    assert lazy_imports("import a\ndef f():\n    if x:\n        from b import c\n    import d") == [4, 5]


def sendings(source):
    """Lines that send over the connection of a vehicle: `link.connection.send(...)`."""
    return [
        node.lineno
        for node in nodes(source, ast.Attribute)
        if node.attr == "send" and isinstance(node.value, ast.Attribute) and node.value.attr == "connection"
    ]


def test_messages_to_a_vehicle_pass_its_link():
    """`VehicleLink.send` sends nothing after a take-over. Estimators command nothing."""
    shells = ("missions.vehicle.link", "missions.estimation", "missions.studies")
    assert found_by_module(lambda name: sendings(source_of(name)), ("missions",), shells) == {}


def test_the_test_sees_sendings():
    assert sendings("vehicle.link.connection.send(message)") == [1]
    assert sendings("vehicle.link.send(message)") == []


def room(name):
    """A folder or file at the top of a package; the package itself is one as well."""
    return name.split(".")[1] if "." in name else name


def rooms(package):
    """By room, the other rooms of the package that it needs, with the imports: (module, needed module)."""
    arrows = {room(name): {} for name in MODULES if is_in(name, (package,))}
    for name in MODULES:
        for item in needed(name) if is_in(name, (package,)) else ():
            if is_in(item, (package,)) and room(item) != room(name):
                arrows[room(name)].setdefault(room(item), []).append((name, item))
    return arrows


@pytest.mark.parametrize("package", PACKAGES)
def test_no_rooms_import_each_other(package):
    """Imports in functions and for type checking count."""
    assert in_circles({name: set(others) for name, others in rooms(package).items()}) == []


def climbs(arrows):
    """Imports of rooms of a higher floor, and of one mission by another."""
    floor = {name: level for level, names in enumerate(FLOORS) for name in names}
    return [
        item
        for name, others in arrows.items()
        for other, items in others.items()
        if floor[other] < floor[name] or (name in THE_MISSIONS and other in THE_MISSIONS)
        for item in items
    ]


def test_missions_stand_in_floors():
    arrows = rooms("missions")
    assert sorted(arrows) == sorted(name for names in FLOORS for name in names)
    assert climbs(arrows) == []


def test_the_test_sees_climbs():
    up = ("missions.vehicle.link", "missions.base.mission")
    beside = ("missions.orbit.mission", "missions.survey.plan")
    within = ("missions.worlds.motions", "missions.embedded.sitl")
    down = ("missions.cli.fly", "missions.errors")
    arrows = {room(name): {room(item): [(name, item)]} for name, item in (up, beside, within, down)}
    assert climbs(arrows) == [up, beside]


FLAG = re.compile(r"(?<![\w-])--[a-z]")


def texts(source):
    """The string literals of a module, without docstrings."""
    documentation = {id(node.value) for node in nodes(source, ast.Expr)}
    return [
        node.value
        for node in nodes(source, ast.Constant)
        if isinstance(node.value, str) and id(node) not in documentation
    ]


def test_only_the_command_line_knows_options():
    """Errors elsewhere name fields in backquotes; `missions.cli.options` puts the options in their place."""

    def options(name):
        return [text for text in texts(source_of(name)) if FLAG.search(text)]

    programs = (  # the command lines of other programs
        "autopilot_bridge.firmware_process.ardupilot",
        *("missions.view.rerun_process", "missions.view.rerun_viewers"),
    )
    assert found_by_module(options, without=("missions.cli", *programs)) == {}


def test_the_test_sees_options():
    found = texts('"""--a"""\nf(f"give --b {x}", "c --- d")')
    assert [text for text in found if FLAG.search(text)] == ["give --b "]


LONGITUDE = re.compile(r"(?<![a-z])(lon|lng|longitude)(?![a-z])", re.IGNORECASE)
WRAPS = ("wrap_180", "longitude_near")


def longitude_differences(source):
    """Subtractions of longitudes that are not the argument of a function that wraps."""
    if not LONGITUDE.search(source):
        return []
    wrapped = {
        id(argument)
        for node in nodes(source, ast.Call)
        if ast.unparse(node.func).rpartition(".")[2] in WRAPS
        for argument in node.args
    }
    return [
        ast.unparse(node)
        for node in nodes(source, ast.BinOp)
        if isinstance(node.op, ast.Sub) and id(node) not in wrapped
        if LONGITUDE.search(ast.unparse(node.right))
    ]


def test_longitudes_are_subtracted_in_one_place():
    """Elsewhere `LocalFrame` and `HomeFrame` make metres of places: a longitude jumps at 180 degrees."""
    evenly = "estimators.survey.geotiff"  # the step of a grid whose longitudes may pass 180 degrees
    found = found_by_module(
        lambda name: longitude_differences(source_of(name)), without=("flightsim.foundation.geodesy", evenly)
    )
    assert found == {}


def test_the_test_sees_longitudes():
    assert longitude_differences(
        "e = (t['lon'] * 1e-7 - o.lon_deg) * k\nwrap_180(lon - o.lon)\nalong - b"
    ) == ["t['lon'] * 1e-07 - o.lon_deg"]


def degrees_on_the_wire(source):
    """Products and quotients with 1e7 or 1e-7, by which degrees and degE7 are made of each other."""
    return [
        ast.unparse(node)
        for node in nodes(source, ast.BinOp)
        if isinstance(node.op, ast.Mult | ast.Div)
        for factor in (node.left, node.right)
        if isinstance(factor, ast.Constant) and factor.value in (1e7, 1e-7)
    ]


def test_units_of_the_wire_are_read_and_written_in_one_place():
    """`wire_units` also knows what a place is; readers of their own accept places that are none."""
    elsewhere = (
        *("autopilot_bridge.telemetry.motion", "autopilot_bridge.sitl.truth"),  # compiled code
        "estimators.logs.units",  # the units of the definition files, by their names
        *("estimators.survey.sources", "flightsim.payload.signature"),  # the magnetic constant
    )
    found = found_by_module(
        lambda name: degrees_on_the_wire(source_of(name)),
        without=("autopilot_bridge.mavlink.wire_units", *elsewhere),
    )
    assert found == {}


def test_the_test_sees_degrees_on_the_wire():
    assert degrees_on_the_wire("lat = 1e-7 * m.lat\nx = round(lon * 1e7)\nabs(error) < 1e-7") == [
        "1e-07 * m.lat",
        "lon * 10000000.0",
    ]


def earth_constants(source):
    """Constants of WGS84 and of the standard atmosphere among the numbers of a source."""
    return sorted(
        {
            node.value
            for node in nodes(source, ast.Constant)
            if isinstance(node.value, int | float)
            for constant in EARTH_CONSTANTS
            if abs(node.value - constant) < 1e-5 * constant
        }
    )


def test_the_foundation_alone_defines_the_earth_and_the_atmosphere():
    found = {name: earth_constants(source_of(name)) for name in MODULES}
    assert {name for name, values in found.items() if values} == {
        "flightsim.foundation.atmosphere",
        "flightsim.foundation.geodesy",
    }


def bare_places(source):
    """Numbers and number ranges that index an array with a layout of its own."""
    found = []
    for node in nodes(source, ast.Subscript):
        array = node.value.attr if isinstance(node.value, ast.Attribute) else getattr(node.value, "id", "")
        parts = [node.slice.lower, node.slice.upper] if isinstance(node.slice, ast.Slice) else [node.slice]
        if array in LAID_OUT and any(isinstance(part, ast.Constant) for part in parts):
            found.append(ast.unparse(node))
    return found


def test_places_of_shared_arrays_have_names():
    within = ("flightsim", "autopilot_bridge")
    assert found_by_module(lambda name: bare_places(source_of(name)), within) == {}


def test_the_test_sees_bare_places():
    found = bare_places("nav[27] + ctx.setpoint[3:5] + nav[n.YAW] + truth[t.ROTOR_RAD_S] + q[3] + sp[-1]")
    assert found == ["nav[27]", "ctx.setpoint[3:5]"]


def test_one_module_wraps_angles_and_one_multiplies_quaternions():
    """A function defined elsewhere under one of these names is a copy."""
    defined = {
        (node.name, name)
        for name in MODULES
        for node in nodes(source_of(name), ast.FunctionDef)
        if node.name.strip("_") in ANGLE_FUNCTIONS
    }
    assert {module.rpartition(".")[0] for _, module in defined} == {"flightsim.foundation"}


@pytest.mark.parametrize(
    ("source", "constants"),
    [
        ("R = 6378137", [6378137]),
        ("R_M = 6_371e3", [6_371e3]),
        ("def f():\n    return 1 / 298.257223563", [298.257223563]),
        ("p = {'g': 9.80665, 'i': 9.81}", [9.80665]),
        ("x = [1.0, True, '9.80665']", []),
    ],
)
def test_the_test_sees_constants(source, constants):
    assert earth_constants(source) == constants


@pytest.mark.parametrize(
    ("name", "source", "wrong"),
    [
        ("flightsim.world", "import autopilot_bridge.links", ["autopilot_bridge.links"]),
        ("flightsim.world", "def f():\n    import time", ["time"]),
        ("flightsim.world", "from pymavlink import mavutil", ["pymavlink", "pymavlink.mavutil"]),
        ("autopilot_bridge.links.udp", "from flightsim import truth", ["flightsim.truth"]),
        (
            "autopilot_bridge.routing",
            "from .autopilot import Autopilot",
            ["autopilot_bridge.autopilot", "autopilot_bridge.autopilot.Autopilot"],
        ),
        ("autopilot_bridge.routing", "from autopilot_bridge import links", []),
        ("autopilot_bridge.routing", "from autopilot_bridge import sitl", ["autopilot_bridge.sitl"]),
        ("autopilot_bridge.sitl.runner", "from flightsim.world import World", []),
        (
            "estimators.ekf",
            "from flightsim.truth import LAT_RAD",
            ["flightsim.truth", "flightsim.truth.LAT_RAD"],
        ),
        ("estimators.ekf", "from autopilot_bridge.mavlink import decode", []),
        ("estimators.ekf", "from flightsim.foundation.kernels import kernel", []),
        ("estimators.ekf", "import autopilot_bridge.navigation", ["autopilot_bridge.navigation"]),
        ("missions.lissajous", "import flightsim", ["flightsim"]),
        ("missions.base.request", "from flightsim.world_spec import WorldSpec", []),
        ("missions.base.request", "import flightsim.world", ["flightsim.world"]),
        ("missions.orbit.world", "from flightsim.world_spec import WorldSpec", []),
        (
            "missions.orbit.mission",
            "from missions.orbit.world import orbit_world",
            ["missions.orbit.world", "missions.orbit.world.orbit_world"],
        ),
        (
            "missions.orbit.mission",
            "from flightsim.world_spec import WorldSpec",
            ["flightsim.world_spec", "flightsim.world_spec.WorldSpec"],
        ),
        ("missions.lissajous", "from autopilot_bridge.clock import Clock", []),
        ("missions.embedded", "from autopilot_bridge.sitl import SitlRunner\nimport flightsim", []),
        ("missions.cli.fly", "from flightsim.world import World", []),
    ],
)
def test_the_test_sees_wrong_arrows(name, source, wrong):
    assert complaints(name, imported(source, name)) == wrong
