"""Converts the events of the flight task into modes and events of the vehicle."""

from functools import partial

from autopilot_bridge.commander.commanded_vehicle import CommandedVehicle
from autopilot_bridge.commander.events import (
    ItemCommanded,
    MissionFinished,
    MissionItemReached,
    ReturnLandingStarted,
    ReturnStarted,
)
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.flight import context as flight


class TaskFollower:
    """Reads the events of the active flight task for the commander."""

    def __init__(self, commander: CommandedVehicle) -> None:
        self._commander = commander

    def follow(self) -> None:
        """Handle the events of the task since the last call; called at 50 Hz."""
        commander = self._commander
        for phase in commander.vehicle.watch(commander.tasks.task, commander.context):
            commander.emit(phase)
        events = commander.context.events
        if not events:
            return
        changes = events[:]
        events.clear()
        for each in changes:
            self._take(each)

    def _take(self, event: flight.FlightEvent) -> None:
        commander = self._commander
        match event:
            case flight.WaypointReached():
                self._item_reached(event)
            case flight.MissionFinished():
                self._mission_finished()
            case flight.MissionModeRequested():
                if commander.policy.mission_return_is_mode and commander.mode is commander.commanded_mode:
                    commander.end_mission(FlightMode.RETURN)
            case flight.ItemCommanded(seq=seq):
                commander.emit(ItemCommanded(time_us=commander.time_us, index=seq))
            case flight.ReturnStarted(down_m=down_m, destination_down_m=destination_down_m):
                frame = commander.context.frame
                if frame is not None:
                    commander.emit(
                        ReturnStarted(
                            time_us=commander.time_us,
                            alt_amsl_m=frame.origin.alt_m - down_m,
                            above_destination_m=destination_down_m - down_m,
                        )
                    )
            case flight.ReturnLandingStarted():
                commander.emit(ReturnLandingStarted(time_us=commander.time_us))
            case flight.HomeChangeRequested():
                frame = commander.context.frame
                if frame is not None:
                    commander.home.command(
                        *frame.geodetic_from_ned(event.north_m, event.east_m, event.down_m)
                    )
            case flight.TaskFinished() if (
                commander.mode is commander.policy.takeoff_mode and commander.mode is commander.commanded_mode
            ):
                source = partial(commander.vehicle.hold_after_takeoff, commander.tasks.task)
                commander.tasks.prepare(FlightMode.HOLD, source)
                commander.change_mode(FlightMode.HOLD)

    def _item_reached(self, event: flight.WaypointReached) -> None:
        commander = self._commander
        items = commander.missions.items
        distance_m = float("nan")
        if event.navigation and event.seq < len(items):
            distance_m = commander.vehicle.distance_to(items[event.seq], commander.context)
        commander.emit(
            MissionItemReached(
                time_us=commander.time_us, index=event.seq, distance_m=distance_m, navigation=event.navigation
            )
        )

    def _mission_finished(self) -> None:
        commander = self._commander
        commander.emit(MissionFinished(time_us=commander.time_us, landed=commander.landed))
        commander.end_mission()
