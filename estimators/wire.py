"""The class of each message as estimators read it: `wire.ATTITUDE`.

The classes are made when they are first used. `wire.pyi` beside this module has the types of their fields;
`python -m estimators.wire_stub` writes it.
"""

from autopilot_bridge.mavlink import definition
from estimators.messages import Message, message_class


def __getattr__(name: str) -> type[Message]:
    if not name.isupper():
        raise AttributeError(name)
    made = globals()[name] = message_class(definition(name))
    return made
