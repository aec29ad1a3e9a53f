"""The page in a real browser: rendered, moving, without a request that leaves the machine. 60 s, slow.

Skipped without Chromium (Debian: `apt-get install chromium`) or `pip install playwright`, which drives it.
"""

import shutil
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest

from tests.missions.view.a_scene import a_scene

pytest.importorskip("rerun", reason="Rerun is not installed: pip install 'flightstack[view]'")
sync_api = pytest.importorskip(
    "playwright.sync_api", reason="playwright is not installed: pip install playwright"
)

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
SIZE = {"width": 900, "height": 560}
MAP = np.s_[60:500, 20:520]  # pixels of the map from above
DEADLINE_MS = 120_000

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium: apt-get install chromium"),
]


def shot(page):
    """The page's pixels, as BGR."""
    return cv2.imdecode(np.frombuffer(page.screenshot(timeout=DEADLINE_MS), np.uint8), cv2.IMREAD_COLOR)


def wait_until(page, holds):
    """The first picture of which something holds, within the deadline."""
    for _ in range(DEADLINE_MS // 2000):
        pixels = shot(page)
        if holds(pixels):
            return pixels
        page.wait_for_timeout(1000)
    pytest.fail("the page did not become as expected")


def amber(pixels):
    """Number of pixels of the map in the colour of a belief."""
    red, green, blue = (pixels[MAP][..., channel].astype(int) for channel in (2, 1, 0))
    return int(np.count_nonzero((red > 200) & (green > 140) & (blue < 120)))


def test_the_page_shows_a_flight_that_goes_on_and_nothing_leaves_the_machine():
    from missions.view.rerun_viewers import RerunPage

    scene = list(a_scene(20))
    half = len(scene) // 2
    viewer = RerunPage(None)
    try:
        viewer.begin("a scene")
        viewer.draw(scene[:half])
        viewer.finish()
        with sync_api.sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=CHROMIUM,
                args=["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
            )
            page = browser.new_page(viewport=SIZE)
            requested, errors = [], []
            page.on("request", lambda request: requested.append(request.url))
            page.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
            page.goto(viewer.where)
            empty = shot(page)
            before = wait_until(page, lambda pixels: amber(pixels) > 30)
            assert np.count_nonzero(np.any(before != empty, axis=2)) > 20_000
            viewer.draw(scene[half:])
            viewer.finish()
            wait_until(
                page, lambda pixels: np.count_nonzero(np.any(pixels[MAP] != before[MAP], axis=2)) > 300
            )
            browser.close()
        hosts = {urlsplit(url).hostname for url in requested if url.startswith("http")}
        assert hosts == {"127.0.0.1"}
        assert errors == []
    finally:
        viewer.close()
