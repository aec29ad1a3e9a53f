"""The messages of the camera component: each function makes one message of its present state."""

import math
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.camera_scan import detection_message
from autopilot_bridge.mavlink.components import GIMBAL_COMPONENT
from autopilot_bridge.mavlink.wire_units import e7, mm, place_e7
from autopilot_bridge.payload.camera_state import SENSOR_WIDTH_MM, CameraState
from autopilot_bridge.payload.component import fixed_text
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.vectors import rotate
from flightsim.payload import Detection

DEFINITION_VERSION: Final = 1
"""Clients cache the camera definition file by this number: increase it with every change of the content."""
DEFINITION_FILE: Final = "camera.xml"
_DEFINITION_URI: Final = f"mftp:///{DEFINITION_FILE}"
_FILM_WIDTH_MM: Final = 36.0
_FORWARD: Final = (1.0, 0.0, 0.0)
_UNKNOWN_DEGE7: Final = 2**31 - 1
_FARTHEST_M: Final = 20_000.0  # at greater distances the ground is no plane


def information(camera: CameraState) -> MAVLinkMessage:
    """CAMERA_INFORMATION."""
    model = camera.device.parameters.model
    flags = (
        dialect.CAMERA_CAP_FLAGS_CAPTURE_IMAGE
        | dialect.CAMERA_CAP_FLAGS_CAPTURE_VIDEO
        | dialect.CAMERA_CAP_FLAGS_HAS_MODES
        | dialect.CAMERA_CAP_FLAGS_HAS_IMAGE_SURVEY_MODE
        | dialect.CAMERA_CAP_FLAGS_CAN_CAPTURE_IMAGE_IN_VIDEO_MODE
        | dialect.CAMERA_CAP_FLAGS_CAN_CAPTURE_VIDEO_IN_IMAGE_MODE
        | dialect.CAMERA_CAP_FLAGS_HAS_TRACKING_POINT
        | dialect.CAMERA_CAP_FLAGS_HAS_TRACKING_RECTANGLE
        | dialect.CAMERA_CAP_FLAGS_HAS_TRACKING_GEO_STATUS
    )
    flags |= dialect.CAMERA_CAP_FLAGS_HAS_BASIC_ZOOM if camera.lens.has_zoom else 0
    flags |= dialect.CAMERA_CAP_FLAGS_HAS_BASIC_FOCUS if camera.lens.has_focus else 0
    flags |= dialect.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM if camera.stream is not None else 0
    return dialect.MAVLink_camera_information_message(
        time_boot_ms=camera.time_ms,
        vendor_name=fixed_text("flightstack", 32),
        model_name=fixed_text("simulated camera", 32),
        firmware_version=0x01000000,
        focal_length=camera.lens.focal_mm,
        sensor_size_h=SENSOR_WIDTH_MM,
        sensor_size_v=SENSOR_WIDTH_MM * model.height_px / model.width_px,
        resolution_h=model.width_px,
        resolution_v=model.height_px,
        lens_id=0,
        flags=flags,
        cam_definition_version=DEFINITION_VERSION,
        cam_definition_uri=fixed_text(_DEFINITION_URI, 140),
        gimbal_device_id=0 if camera.device.gimbal is None else GIMBAL_COMPONENT,
    )


def capture_status(camera: CameraState, time_us: int) -> MAVLinkMessage:
    """CAMERA_CAPTURE_STATUS; between two photos of a series the camera is idle with an interval set."""
    since_us = camera.recording_since_us
    return dialect.MAVLink_camera_capture_status_message(
        time_boot_ms=camera.time_ms,
        image_status=2 if camera.trigger.series else 0,
        video_status=1 if since_us is not None else 0,
        image_interval=1e-6 * camera.trigger.interval_us if camera.trigger.series else 0.0,
        recording_time_ms=0 if since_us is None else (time_us - since_us) // 1000 & 0xFFFFFFFF,
        available_capacity=max(0.0, camera.storage.available_mib - camera.recorded_mib),
        image_count=camera.storage.images,
    )


def image_captured(
    camera: CameraState, time_us: int, index: int, name: str
) -> dialect.MAVLink_camera_image_captured_message:
    """CAMERA_IMAGE_CAPTURED: position from the autopilot, orientation as known to the camera."""
    here = camera.vehicle.located(time_us)
    q = camera.orientation
    relative_alt_m = camera.vehicle.relative_alt_m
    return dialect.MAVLink_camera_image_captured_message(
        time_boot_ms=camera.time_ms,
        time_utc=camera.vehicle.unix_us(time_us),
        camera_id=0,
        lat=0 if here is None else e7(here.lat_deg),
        lon=0 if here is None else e7(here.lon_deg),
        alt=0 if here is None else mm(here.alt_m),
        relative_alt=0 if here is None or math.isnan(relative_alt_m) else mm(relative_alt_m),
        q=[math.nan] * 4 if q is None else list(q),
        image_index=index,
        capture_result=1,
        file_url=fixed_text(name, 205),
    )


def photo_notes(camera: CameraState) -> dict[str, float]:
    """The data for a photo's file."""
    notes = {
        "focal_mm": camera.lens.focal_mm,
        "quality": camera.photo_quality,
        "focal_35_mm": camera.lens.focal_mm * _FILM_WIDTH_MM / SENSOR_WIDTH_MM,
    }
    here, q = camera.vehicle.located(camera.time_us), camera.orientation
    if here is not None:
        notes |= {"lat_deg": here.lat_deg, "lon_deg": here.lon_deg, "alt_m": here.alt_m}
    if q is not None:
        north, east, _ = rotate(q, _FORWARD)
        notes["yaw_deg"] = math.degrees(math.atan2(east, north))
    unix_us = camera.vehicle.unix_us(camera.time_us)
    if unix_us:
        notes["unix_us"] = unix_us
    return notes


def fov_status(camera: CameraState, time_us: int) -> MAVLinkMessage:
    """CAMERA_FOV_STATUS: the camera's position, and the ground point at the centre of its picture."""
    here, q = camera.vehicle.located(time_us), camera.orientation
    ground = None if here is None or q is None else ground_point(camera, here, rotate(q, _FORWARD))
    width_rad, height_rad = camera.lens.fov_rad
    lat_camera, lon_camera, alt_camera = _dege7(here)
    lat_image, lon_image, alt_image = _dege7(ground)
    return dialect.MAVLink_camera_fov_status_message(
        time_boot_ms=camera.time_ms,
        lat_camera=lat_camera,
        lon_camera=lon_camera,
        alt_camera=alt_camera,
        lat_image=lat_image,
        lon_image=lon_image,
        alt_image=alt_image,
        q=[math.nan] * 4 if q is None else list(q),
        hfov=math.degrees(width_rad),
        vfov=math.degrees(height_rad),
    )


def tracking_geo_status(camera: CameraState, time_us: int) -> MAVLinkMessage:
    """CAMERA_TRACKING_GEO_STATUS: the ground position of the tracked target."""
    tracker, here, q = camera.tracker, camera.vehicle.located(time_us), camera.orientation
    place, distance_m, heading_rad = None, math.nan, math.nan
    if tracker.thing is not None and here is not None and q is not None:
        right, down = tracker.thing.detection.normalised
        place = ground_point(camera, here, rotate(q, (1.0, right, down)))
        if place is not None:
            north_m, east_m, down_m = LocalFrame(here).ned_from_geodetic(
                place.lat_deg, place.lon_deg, place.alt_m
            )
            distance_m = math.hypot(north_m, east_m, down_m)
            heading_rad = math.atan2(east_m, north_m)
    lat, lon, _ = _dege7(place)
    nan = math.nan
    return dialect.MAVLink_camera_tracking_geo_status_message(
        tracking_status=tracker.status(),
        lat=0 if place is None else lat,
        lon=0 if place is None else lon,
        alt=nan if place is None else place.alt_m,
        h_acc=nan,
        v_acc=nan,
        vel_n=nan,
        vel_e=nan,
        vel_d=nan,
        vel_acc=nan,
        dist=distance_m,
        hdg=heading_rad,
        hdg_acc=nan,
    )


def ground_point(
    camera: CameraState, here: GeodeticPosition, ray_ned: tuple[float, float, float]
) -> GeodeticPosition | None:
    """The point where a ray meets level ground at home's height; None: no such point within range."""
    height_m = here.alt_m - camera.vehicle.home_alt_m
    north, east, down = ray_ned
    if not (height_m > 0.0 and down > 0.0 and height_m / down * math.hypot(north, east) < _FARTHEST_M):
        return None
    lat_deg, lon_deg, alt_m = LocalFrame(here).geodetic_from_ned(
        height_m / down * north, height_m / down * east, height_m
    )
    return GeodeticPosition(lat_deg=max(-90.0, min(90.0, lat_deg)), lon_deg=lon_deg, alt_m=alt_m)


def landing_target(detection: Detection) -> MAVLinkMessage:
    """LANDING_TARGET of a detection."""
    return detection_message(
        detection.time_us,
        detection.target_id if detection.target_id >= 0 else None,
        angle_x_rad=detection.angle_x_rad,
        angle_y_rad=detection.angle_y_rad,
        distance_m=detection.distance_m,
        size_rad=detection.size_rad,
    )


def _dege7(place: GeodeticPosition | None) -> tuple[int, int, int]:
    """Latitude, longitude (degE7) and altitude (mm); INT32_MAX: not known."""
    if place is None:
        return (_UNKNOWN_DEGE7,) * 3
    return place_e7(place)
