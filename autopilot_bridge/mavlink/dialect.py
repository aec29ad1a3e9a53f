"""The dialect in use: MAVLink's `all`, by the name under which every module imports it.

The messages, constants and enumerations are pymavlink's own, which carry no types, and the messages of
`missing_messages`. `dialect.pyi` beside this module has their types; `python -m
autopilot_bridge.mavlink.dialect_stub` writes it.
"""

from pymavlink.dialects.v20.all import *  # noqa: F403

from autopilot_bridge.mavlink import missing_messages

MAVLink_link_node_status_message = missing_messages.LinkNodeStatus
MAVLink_protocol_version_message = missing_messages.ProtocolVersion
MAVLink_time_estimate_to_target_message = missing_messages.TimeEstimateToTarget
MAVLink_component_metadata_message = missing_messages.ComponentMetadata
MAVLink_event_message = missing_messages.EventMessage
MAVLink_current_event_sequence_message = missing_messages.CurrentEventSequence
MAVLink_request_event_message = missing_messages.RequestEvent
MAVLink_response_event_error_message = missing_messages.ResponseEventError
