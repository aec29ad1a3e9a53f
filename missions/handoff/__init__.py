"""The mission `handoff`: one aircraft takes a ground target over from another, without GPS."""
