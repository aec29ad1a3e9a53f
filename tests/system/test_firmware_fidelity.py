"""What counts as a difference between a real firmware and its emulation, and which ones are accepted."""

import pytest

from benchmarks.firmware_fidelity import accepted, differences

REAL: dict[str, str | float] = {
    "answer on the ground: REQUEST_MESSAGE 8": "0",
    "modes": "4 3",
    "rate in the air: ATTITUDE": 50.0,
    "rate in the air: SIMSTATE": 4.0,
    "field: ATTITUDE.roll": "numbers",
    "field: SIMSTATE.roll": "numbers",
    "time: from arming to lift-off": 4.0,
    "path: overshoot of the step": 0.1,
}


def test_tolerances_of_rates_times_and_paths():
    near = {
        **REAL,
        "rate in the air: ATTITUDE": 45.0,
        "time: from arming to lift-off": 4.9,
        "path: overshoot of the step": 0.35,
    }
    assert differences(REAL, near) == {}
    far = {**REAL, "rate in the air: ATTITUDE": 30.0, "path: overshoot of the step": 0.5, "modes": "4 5 3"}
    assert differences(REAL, far) == {
        "modes": ("4 3", "4 5 3"),
        "path: overshoot of the step": (0.1, 0.5),
        "rate in the air: ATTITUDE": (50.0, 30.0),
    }


def test_a_message_that_one_does_not_send_is_one_difference_without_its_fields():
    without = {name: value for name, value in REAL.items() if "SIMSTATE" not in name}
    assert differences(REAL, without) == {"rate in the air: SIMSTATE": (4.0, None)}


@pytest.mark.parametrize("firmware", ["px4", "ardupilot"])
def test_each_accepted_difference_has_a_reason(firmware):
    found = accepted(firmware)
    assert found and all(found.values())


def test_an_entry_without_a_reason_is_refused(tmp_path):
    file = tmp_path / "accepted.toml"
    file.write_text('[[px4]]\ndifferences = ["text: *"]\nreason = ""\n')
    with pytest.raises(ValueError, match="has no reason"):
        accepted("px4", file)
