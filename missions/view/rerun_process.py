"""Rerun's viewer as a process of its own. It listens on this machine only and sends no statistics."""

import importlib.util
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from missions.view.viewer import ViewError

__all__ = ["ViewerProcess", "free_port", "is_free"]

LOOPBACK: Final = "127.0.0.1"
_BUFFERED: Final = "1GiB"  # for pages that are opened late
_STARTS_WITHIN_S: Final = 20.0
_LOOK_S: Final = 0.05
_ENDS_WITHIN_S: Final = 3.0


def is_free(port: int) -> bool:
    """Whether nothing listens on a port of this machine."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((LOOPBACK, port))
        except OSError:
            return False
    return True


def free_port(usual: int) -> int:
    """A port on which nothing listens: the usual one if it is free."""
    if is_free(usual):
        return usual
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


class ViewerProcess:
    """A running viewer.

    Args:
        arguments: of its command line, beside address, ports and limits.
        port: on which it receives what is drawn.

    Raises:
        ViewError: it does not start.
    """

    def __init__(self, arguments: Sequence[str], port: int) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="flightstack-view-"))
        command = [str(_program()), "--bind", LOOPBACK, "--port", str(port), *arguments]
        command += ["--server-memory-limit", _BUFFERED]
        self._errors = (self._folder / "errors").open("w+b")
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=self._errors,
            env=_environment(self._folder),
            start_new_session=True,  # Ctrl-C ends the flight, not the viewer
        )
        self.url = f"rerun+http://{LOOPBACK}:{port}/proxy"
        self._wait_for(port)

    @property
    def running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def _wait_for(self, port: int) -> None:
        for _ in range(round(_STARTS_WITHIN_S / _LOOK_S)):
            try:
                code = self._process.wait(_LOOK_S)
            except subprocess.TimeoutExpired:
                with socket.socket() as probe:
                    probe.settimeout(_LOOK_S)
                    if probe.connect_ex((LOOPBACK, port)) == 0:
                        return
            else:
                self._errors.seek(0)
                lines = self._errors.read().decode("utf-8", "replace").split("\n")
                reason = next((line for line in reversed(lines) if line.strip()), f"exit code {code}")
                self.close()
                raise ViewError(f"Rerun's viewer ended at once: {reason.strip()}; try `view=web` or a file")
        self.close()
        raise ViewError(f"Rerun's viewer did not start within {_STARTS_WITHIN_S:g} s; try a file, FILE.rrd")

    def close(self) -> None:
        """End it."""
        self._process.terminate()
        try:
            self._process.wait(_ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._errors.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def leave(self) -> None:
        """Let it run on without this program."""
        self._errors.close()


def _program() -> Path:
    """The viewer in the installed package; started by itself, since its script would leave it behind."""
    spec = importlib.util.find_spec("rerun_cli")
    folder = Path(spec.origin).parent if spec is not None and spec.origin is not None else Path()
    suffix = ".exe" if sys.platform == "win32" else ""
    bundled = folder / "Rerun.app" / "Contents" / "MacOS" / "Rerun"  # macOS
    return bundled if bundled.exists() else folder / f"rerun{suffix}"


def _environment(folder: Path) -> Mapping[str, str]:
    """The environment of a viewer: settings of its own, in which usage statistics are off. Where the system
    has another place for settings, they are turned off in the user's.
    """
    if sys.platform != "linux":
        off = [str(_program()), "analytics", "disable"]
        subprocess.run(off, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    path = folder / "rerun" / "analytics.json"
    settings = {
        "analytics_enabled": False,
        "analytics_id": "none",
        "metadata": {},
        "config_file_path": str(path),
        "data_dir_path": str(folder / "statistics"),
    }
    path.parent.mkdir()
    path.write_text(json.dumps(settings), encoding="utf-8")
    return {**os.environ, "XDG_CONFIG_HOME": str(folder), "TELEMETRY_ENABLED": "false"}
