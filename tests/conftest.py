"""Settings of the whole suite.

Property tests draw the same examples on every run, so that no run is luckier than another. Ctrl-C works in
the tests and the programs they start, even where the suite runs in the background of a shell.
"""

import signal

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

signal.signal(signal.SIGINT, signal.default_int_handler)
