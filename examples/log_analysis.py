"""Log analysis: what a flight log holds, the autopilot's errors, and an estimator over the log.

    flightstack fly lissajous --out flown
    python examples/log_analysis.py flown/flight.tlog

It also reads the logs of flight controllers (.bin, .ulg). Logs of simulated flights hold the truth, too.
"""

import sys

import numpy as np

from flightstack import LogError, comparisons, make_estimator, open_log, replay

AUTOPILOT, SIMULATOR = 1, 25  # component ids

if len(sys.argv) != 2:
    sys.exit("usage: python examples/log_analysis.py LOG")
try:
    log = open_log(sys.argv[1])
except LogError as error:
    sys.exit(str(error))
print(f"{log.path}: {log.format}, {log.duration_s:.0f} s, systems {', '.join(map(str, log.systems))}")

# 1. Columns. `si` gives SI units and radians in place of the wire's units (mm, degE7).
vehicle = min(log.systems)
position = log.table("GLOBAL_POSITION_INT", system_id=vehicle, component_id=AUTOPILOT)
height_m = position.si("relative_alt")
speed_m_s = np.hypot(position.si("vx"), position.si("vy"))
rate_hz = log.rate_hz("GLOBAL_POSITION_INT", system_id=vehicle, component_id=AUTOPILOT)
highest = f"{height_m.max():.1f} m above home and {speed_m_s.max():.1f} m/s"
print(f"vehicle {vehicle}: at most {highest}, from {len(position)} positions at {rate_hz:.0f} Hz")

# 2. The autopilot's estimate against the truth, at the times of the estimate.
if log.has("HIL_STATE_QUATERNION", system_id=vehicle, component_id=SIMULATOR):
    truth = log.table("HIL_STATE_QUATERNION", system_id=vehicle, component_id=SIMULATOR)
    true_alt_m = np.interp(position.time_us, truth.time_us, truth.si("alt"))
    error_m = position.si("alt") - true_alt_m
    print(f"altitude estimate: {np.sqrt(np.mean(error_m**2)):.2f} m RMS off the truth")

# 3. An estimator over the log, compared with the autopilot and the truth in the air.
replayed = replay(log, lambda: make_estimator("attitude"))
for system_id, reasons in replayed.lacking.items():
    print(f"vehicle {system_id}: {'; '.join(reasons)}")
for runner in replayed.fleet.runners.values():
    for comparison in comparisons([log], runner):
        for reference, figures in comparison.figures.items():
            for figure in figures:
                rms = f"{figure.rms:.2f} {figure.unit} RMS"
                print(f"attitude, {comparison.label}: {figure.quantity} {rms} off the {reference}")
