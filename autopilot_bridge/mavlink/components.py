"""Component ids (MAV_COMPONENT): who is who in a vehicle's system, for all packages."""

from typing import Final

from autopilot_bridge.mavlink import dialect

AUTOPILOT_COMPONENT: Final = dialect.MAV_COMP_ID_AUTOPILOT1
SIMULATOR_COMPONENT: Final = dialect.MAV_COMP_ID_USER1
"""The simulator of an embedded SITL, which sends the truth."""
TARGET_SENSOR_COMPONENT: Final = dialect.MAV_COMP_ID_USER2
RANGE_RADIO_COMPONENT: Final = dialect.MAV_COMP_ID_USER3
MOVING_POINT_COMPONENT: Final = dialect.MAV_COMP_ID_USER4
"""The camera that reports the points that move in its pictures."""
CAMERA_COMPONENT: Final = dialect.MAV_COMP_ID_CAMERA
CAMERA_COMPONENTS: Final = range(dialect.MAV_COMP_ID_CAMERA, dialect.MAV_COMP_ID_CAMERA6 + 1)
GIMBAL_COMPONENT: Final = dialect.MAV_COMP_ID_GIMBAL
SURVEY_MAGNETOMETER_COMPONENT: Final = dialect.MAV_COMP_ID_PERIPHERAL
"""The magnetometer of a survey."""
GROUND_STATION_COMPONENT: Final = dialect.MAV_COMP_ID_MISSIONPLANNER
"""A program on the ground, as ground stations have it."""
GROUND_STATION: Final = (255, GROUND_STATION_COMPONENT)
"""System and component id of a program on the ground."""
ONBOARD_COMPUTER_COMPONENT: Final = dialect.MAV_COMP_ID_ONBOARD_COMPUTER
"""An estimator."""
