"""An own mission: an outward spiral around home, flown by streamed setpoints.

    flightstack fly examples/own_mission.py --altitude 15 --speed 4 --arg radius_m=30 --arg spacing_m=8

The same file flies on a real vehicle: add `--connect URL`.
"""

import math

from flightstack import Battery, FlightOptions, PlanError, Position, Setpoint, Vehicle


class Mission:
    """A class instead of a plain `fly` function, because this mission checks its arguments."""

    def check(self, options: FlightOptions) -> None:
        """Refuse arguments that can't be flown. This is called before anything is started."""
        spacing_m, radius_m = _arguments(options)
        if not 2.0 <= spacing_m < radius_m <= 500.0:
            raise PlanError(
                f"spacing_m={spacing_m:g} and radius_m={radius_m:g} are not possible; "
                "ask for 2 <= spacing_m < radius_m <= 500"
            )

    async def fly(self, vehicle: Vehicle, options: FlightOptions) -> None:
        """Fly the spiral; the vehicle is ready to arm."""
        spacing_m, radius_m = _arguments(options)
        growth_m = spacing_m / math.tau  # of the radius, per radian of the spiral r = growth x angle

        def setpoint(time_s: float) -> Setpoint | None:
            """Position and velocity on the spiral, NED from home; None at its end."""
            # The arc length of the spiral is close to growth x angle^2 / 2. It begins after one turn.
            angle_rad = math.sqrt(math.tau**2 + 2.0 * options.speed_m_s * time_s / growth_m)
            r_m = growth_m * angle_rad
            if r_m > radius_m:
                return None
            rate_rad_s = options.speed_m_s / r_m
            cos, sin = math.cos(angle_rad), math.sin(angle_rad)
            return Setpoint(
                position_ned_m=(r_m * cos, r_m * sin, -options.altitude_m),
                velocity_ned_m_s=(
                    rate_rad_s * (growth_m * cos - r_m * sin),
                    rate_rad_s * (growth_m * sin + r_m * cos),
                    0.0,
                ),
            )

        await vehicle.arm()
        await vehicle.takeoff(options.altitude_m)
        await vehicle.goto_ned(spacing_m, 0.0, -options.altitude_m)
        await vehicle.follow(setpoint, rate_hz=options.rate_hz)
        position, battery = vehicle.latest(Position), vehicle.latest(Battery)
        if position is not None and battery is not None:
            print(f"spiral flown at {position.height_m:.1f} m, {battery.remaining:.0%} battery left")
        await vehicle.return_to_launch()


def _arguments(options: FlightOptions) -> tuple[float, float]:
    """Distance of the turns and radius of the last one, m: what `--arg` gave, or a default."""
    try:
        return float(options.arguments.get("spacing_m", "8")), float(options.arguments.get("radius_m", "30"))
    except ValueError as error:
        raise PlanError(f"--arg spacing_m=M and --arg radius_m=M take numbers: {error}") from None
