"""What `flightstack` imports and compiles, done once in the server that forks it for the tests."""

import gc
import importlib

import matplotlib

from tests.compiled import compile_in_turn

matplotlib.use("Agg")
for name in (
    "estimators.library",
    "estimators.log_replay",
    "matplotlib.pyplot",
    "mavsdk.asyncio",
    "missions.cli.bodies.estimate",
    "missions.cli.bodies.fly",
    "missions.cli.bodies.sitl",
    "missions.cli.bodies.vehicle",
    "missions.embedded",
    "missions.estimation.live",
    "missions.library",
    "missions.flown.picture",
    "missions.vehicle.concurrency",
    "missions.vehicle_client.doctor",
    "missions.vehicle_client.logs",
):
    importlib.import_module(name)
compile_in_turn()
gc.collect()
gc.freeze()  # pages that the forked processes share
