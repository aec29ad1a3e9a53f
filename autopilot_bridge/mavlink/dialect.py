"""The dialect in use: MAVLink's `all`, by the name under which every module imports it.

The messages, constants and enumerations are pymavlink's own, which carry no types, and the messages of
`event_messages`. `dialect.pyi` beside this module has their types; `python -m
autopilot_bridge.mavlink.dialect_stub` writes it.
"""

from pymavlink.dialects.v20.all import *  # noqa: F403

from autopilot_bridge.mavlink import event_messages

MAVLink_component_metadata_message = event_messages.ComponentMetadata
MAVLink_event_message = event_messages.EventMessage
MAVLink_current_event_sequence_message = event_messages.CurrentEventSequence
MAVLink_request_event_message = event_messages.RequestEvent
MAVLink_response_event_error_message = event_messages.ResponseEventError
