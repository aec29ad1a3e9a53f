"""The page with Rerun's viewer, served on this machine only. It loads nothing from elsewhere and sends
nothing there.

Rerun's own page asks for fonts, examples, news and usage statistics on the network. This one has none of
that: its content security policy lets it reach this machine only.
"""

import threading
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Final
from urllib.request import urlopen

from missions.view.viewer import ViewError

__all__ = ["PageServer"]

_ASSETS: Final = {"/re_viewer.js": "text/javascript", "/re_viewer_bg.wasm": "application/wasm"}
_READ_WITHIN_S: Final = 30.0
_POLICY: Final = (
    "default-src 'self'; connect-src 'self' {data}; script-src 'self' 'unsafe-inline' 'unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; worker-src 'self' blob:"
)
_PAGE: Final = """<!DOCTYPE html>
<html>
<head>
<meta charset="utf-8">
<title>flightstack</title>
<link rel="icon" href="data:,">
<style>
html, body { margin: 0; height: 100%; overflow: hidden; background: #0d1011; color: #cad8de; font: 16px
sans-serif; } canvas { width: 100%; height: 100%; display: block; } p { position: absolute; left: 2em; top:
1em; } </style> </head> <body> <p id="state">loading the viewer ...</p> <canvas id="viewer"></canvas> <script
src="re_viewer.js"></script> <script> const fetched = window.fetch; window.fetch = (request, options) => {
  const url = new URL(request.url ?? request, location);
  return ["127.0.0.1", "localhost"].includes(url.hostname)
    ? fetched(request, options)
    : Promise.resolve(new Response("", { status: 404 }));
};
const state = document.getElementById("state");
wasm_bindgen({ module_or_path: "re_viewer_bg.wasm" })
  .then(() => {
    const viewer = new wasm_bindgen.WebHandle({
      url: ["DATA_URL"], hide_welcome_screen: true, persist: false, notebook: false, enable_history: false,
      theme: "dark",
    });
    return viewer.start(document.getElementById("viewer"));
  })
  .then(() => state.remove())
  .catch((error) => { state.textContent = "the viewer did not start: " + error; });
</script>
</body>
</html>
"""


class PageServer:
    """Serves the page, in a thread, for any number of browsers.

    Args:
        port: of the page.
        viewer: address of the server from which the viewer's program is read once: "http://127.0.0.1:1234".
        data_url: what the page connects to: "rerun+http://127.0.0.1:9876/proxy".

    Raises:
        ViewError: the program can't be read, or the port is in use.
    """

    def __init__(self, port: int, viewer: str, data_url: str) -> None:
        data = data_url.removeprefix("rerun+").removesuffix("/proxy")
        files = {"/": ("text/html; charset=utf-8", _PAGE.replace("DATA_URL", data_url).encode())}
        try:
            for path, kind in _ASSETS.items():
                with urlopen(viewer + path, timeout=_READ_WITHIN_S) as answer:
                    files[path] = kind, answer.read()
            handler = partial(_Handler, files, _POLICY.format(data=data))
            self._server = ThreadingHTTPServer(("127.0.0.1", port), handler)
        except OSError as error:
            raise ViewError(
                f"can't serve the page on port {port}: {error}; give another one, web:PORT"
            ) from error
        self._thread = threading.Thread(target=self._server.serve_forever, name="view page", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End it."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _Handler(BaseHTTPRequestHandler):
    """Answers with files from memory."""

    def __init__(self, files: dict[str, tuple[str, bytes]], policy: str, *arguments: Any) -> None:
        self._files, self._policy = files, policy
        super().__init__(*arguments)

    def do_GET(self) -> None:
        """Send a file."""
        found = self._files.get(self.path.partition("?")[0])
        if found is None:
            self.send_error(404)
            return
        kind, content = found
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Content-Security-Policy", self._policy)
        self.end_headers()
        try:
            self.wfile.write(content)
        except OSError:  # the browser has gone
            return

    def log_message(self, format: str, *arguments: Any) -> None:
        """Nothing is logged."""
