"""Our Aerosonde in JSBSim beside the book's equations: trims, modes, stall speed, glide.

    python benchmarks/aerosonde_book.py

The book's side is `beard_mclain.py`, which uses no JSBSim. Exit code 1 when a trim is off by more than 5 %
or a mode by more than 10 %.
"""

import argparse
import math
import sys
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from beard_mclain import ELEVATOR_TRAVEL_RAD, Book

from flightsim.flight_envelope import flight_envelope
from flightsim.linear_modes import linearise
from flightsim.trim_flight import FlightTrim, trim_in_tunnel
from flightsim.wind_tunnel import WindTunnel

SPEEDS_M_S = (18.0, 20.0, 22.0, 25.0, 28.0, 31.0)
RADII_M = (200.0, 100.0)
TRIM_TOLERANCE = 0.05
MODE_TOLERANCE = 0.10


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One figure of both."""

    group: str
    case: str
    quantity: str
    ours: float
    book: float
    tolerance: float

    @property
    def difference(self) -> float:
        """Relative to the book."""
        return (self.ours - self.book) / abs(self.book)

    @property
    def good(self) -> bool:
        """Within tolerance."""
        return abs(self.difference) <= self.tolerance


def trim_rows(tunnel: WindTunnel, book: Book) -> list[Row]:
    """Straight flight at several speeds, and turns."""
    rows: list[Row] = []
    near: FlightTrim | None = None
    for speed in SPEEDS_M_S:
        for radius in (math.inf, *RADII_M):
            turning = math.isfinite(radius)
            ours = near = trim_in_tunnel(
                tunnel, airspeed_m_s=speed, turn_radius_m=radius if turning else None, near=near
            )
            theirs = book.trim(speed, radius=radius)
            case = f"{speed:.0f} m/s, " + (f"radius {radius:.0f} m" if turning else "straight")
            values = [
                ("alpha, deg", math.degrees(ours.angle_of_attack_rad), math.degrees(theirs.alpha)),
                (
                    "elevator, deg",
                    -math.degrees(ours.elevator * ELEVATOR_TRAVEL_RAD),
                    math.degrees(theirs.de),
                ),
                ("throttle", ours.throttle, theirs.dt),
            ]
            if turning:
                values.append(("bank, deg", math.degrees(ours.roll_rad), math.degrees(theirs.phi)))
            rows += [
                Row(group="trim", case=case, quantity=name, ours=a, book=b, tolerance=TRIM_TOLERANCE)
                for name, a, b in values
            ]
    return rows


def mode_rows(tunnel: WindTunnel, book: Book, speed: float = 25.0) -> list[Row]:
    """Frequency and damping, or time constant."""
    model = linearise(tunnel, trim_in_tunnel(tunnel, airspeed_m_s=speed))
    ours = {
        "short period": model.short_period,
        "phugoid": model.phugoid,
        "Dutch roll": model.dutch_roll,
        "roll": model.roll,
        "spiral": model.spiral,
    }
    rows: list[Row] = []
    for name, root in book.modes(speed).items():
        mode = ours[name]
        values = [("time constant, s", mode.time_constant_s, -1.0 / root.real)]
        if root.imag:
            values = [
                ("frequency, rad/s", mode.frequency_rad_s, abs(root)),
                ("damping", mode.damping, -root.real / abs(root)),
            ]
        rows += [
            Row(
                group="mode",
                case=f"{name}, {speed:.0f} m/s",
                quantity=q,
                ours=a,
                book=b,
                tolerance=MODE_TOLERANCE,
            )
            for q, a, b in values
        ]
    return rows


def performance_rows(tunnel: WindTunnel, book: Book) -> list[Row]:
    """Stall speed (true), glide with the throttle closed, lift over drag of the airframe alone."""
    envelope = flight_envelope("aerosonde")
    to_true = tunnel.true_airspeed_m_s(1.0)
    speed, ratio = book.best_glide(envelope.airspeed_min_m_s * to_true)
    values = (
        ("stall speed, m/s", envelope.stall_speed_m_s * to_true, book.stall_speed()),
        ("best glide ratio, throttle closed", envelope.glide_ratio, ratio),
        ("its speed, m/s", envelope.best_glide_speed_m_s * to_true, speed),
        ("best lift over drag of the airframe", best_lift_over_drag(tunnel), book.best_lift_over_drag()),
    )
    return [
        Row(group="performance", case="", quantity=q, ours=a, book=b, tolerance=TRIM_TOLERANCE)
        for q, a, b in values
    ]


def best_lift_over_drag(tunnel: WindTunnel) -> float:
    """Highest over level trims at speeds half a metre per second apart."""
    best = 0.0
    near: FlightTrim | None = None
    for half_metres in range(28, 60):
        near = trim_in_tunnel(tunnel, airspeed_m_s=0.5 * half_metres, near=near)
        tunnel.measure(near.state)
        best = max(best, tunnel.value("aero/lift-lbs") / tunnel.value("aero/drag-lbs"))
    return best


def all_rows() -> list[Row]:
    """Everything, in still air at the standard place's density."""
    tunnel = WindTunnel("aerosonde")
    book = Book(tunnel.density_kg_m3)
    return [*trim_rows(tunnel, book), *mode_rows(tunnel, book), *performance_rows(tunnel, book)]


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.parse_args()
    rows = all_rows()
    group = ""
    for row in rows:
        if row.group != group:
            group = row.group
            sys.stdout.write(f"\n{group:<28}{'':<36}{'ours':>10}{'book':>10}{'difference':>12}\n")
        sys.stdout.write(
            f"{row.case:<28}{row.quantity:<36}{row.ours:>10.4f}{row.book:>10.4f}"
            f"{100.0 * row.difference:>10.2f} %{'' if row.good else '  <-- off'}\n"
        )
    bad = [row for row in rows if not row.good]
    sys.stdout.write(f"\n{len(rows)} figures, {len(bad)} off\n")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
