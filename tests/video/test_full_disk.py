"""Photos and videos that can't be written: nothing torn is left, and it is reported."""

import resource
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import av
import numpy as np
import pytest

from autopilot_bridge.video import CameraOnShow, VideoParameters, VideoService
from autopilot_bridge.video.photo import save_photo
from flightsim.payload import CameraView, PinholeModel
from flightsim.picture import Scenery

DEADLINE_S = 100.0
NOTES = {"quality": 90}
FULL_BYTES = 1024  # no file gets longer: as on a full disk


class Camera:
    def view(self, time_us: int) -> CameraView:
        return CameraView(
            time_us=time_us, eye_ned_m=(0.0, 0.0, -30.0), q_ned_from_mount=(0.9, 0.0, -0.43589, 0.0)
        )


class Show:
    """A picture process on a disk that can fill up."""

    def __init__(self, folder: Path) -> None:
        self.lost: list[str] = []
        shown = CameraOnShow(name="camera1", camera=Camera(), model=PinholeModel(width_px=320, height_px=240))
        self.service = VideoService(
            [shown],
            scenery=Scenery(),
            parameters=VideoParameters(port=None, folder=folder),
            on_loss=self.lost.append,
        )
        self.time_us = 0
        self.folder = folder / "camera1"
        # One of each before the disk is full: by then all is imported, compiled, and cached in files.
        self.service.start_recording(0, 0)
        video = self.folder / "VID_0000.mp4"
        self.until(lambda: video.exists() and video.stat().st_size)
        self.service.stop_recording(0)
        self.service.photo(0, 0, NOTES)
        self.until(lambda: not self.service._photos_under_way)

    def fill_up(self, full: bool) -> None:
        process = self.service._process
        assert process is not None
        _, hard = resource.prlimit(process.pid, resource.RLIMIT_FSIZE)
        soft = FULL_BYTES if full else hard
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (soft, hard))

    def until(self, found: Callable[[], object]) -> None:
        deadline_s = time.monotonic() + DEADLINE_S
        while not found():
            assert time.monotonic() < deadline_s, self.lost
            self.time_us += 50_000
            self.service.poll(self.time_us)
            time.sleep(0.01)  # it is done when it is done: another process


@pytest.fixture
def show(tmp_path: Path) -> Iterator[Show]:
    made = Show(tmp_path / "pictures")
    yield made
    made.service.close()


def test_a_photo_that_does_not_fit_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "photo.jpg"
    picture = np.random.default_rng(1).integers(0, 255, (100, 100, 3), np.uint8)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (FULL_BYTES, hard))
    try:
        with pytest.raises(OSError, match="too large"):
            save_photo(path, picture, NOTES)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not path.exists()
    save_photo(path, picture, NOTES)
    with pytest.raises(FileExistsError):
        save_photo(path, picture, NOTES)
    assert path.stat().st_size > FULL_BYTES


def test_photos_and_videos_that_do_not_fit_are_reported_and_the_next_ones_are_whole(show: Show) -> None:
    folder = show.folder
    show.fill_up(True)
    show.service.photo(0, 0, NOTES)
    show.until(lambda: show.lost)
    assert show.lost == [f"can't write photo {folder / 'IMG_0001.jpg'}: File too large"]
    assert not (folder / "IMG_0001.jpg").exists()
    show.service.start_recording(0, show.time_us)
    show.until(lambda: len(show.lost) > 1)
    assert show.lost[1] == f"can't write video {folder / 'VID_0001.mp4'}: File too large"
    show.service.stop_recording(0)

    show.fill_up(False)
    show.service.photo(0, 0, NOTES)
    video = folder / "VID_0002.mp4"
    show.service.start_recording(0, show.time_us)
    show.until(lambda: video.exists() and video.stat().st_size)
    show.service.close()
    assert len(show.lost) == 2
    assert (folder / "IMG_0002.jpg").stat().st_size > FULL_BYTES
    with av.open(str(video)) as container:
        assert next(container.decode(video=0)).width == 320


@pytest.mark.slow
def test_what_is_lost_at_the_end_is_reported_too(show: Show) -> None:
    show.fill_up(True)
    show.service.photo(0, 0, NOTES)
    show.service.start_recording(0, show.time_us)
    show.service.poll(show.time_us)
    show.service.close()
    assert len(show.lost) == 2 and all("File too large" in text for text in show.lost)


@pytest.mark.parametrize("under_way", ["photo", "video", "nothing"])
@pytest.mark.sampled(1)
def test_a_picture_process_that_dies_is_reported_when_it_matters(show: Show, under_way: str) -> None:
    process = show.service._process
    assert process is not None
    process.send_signal(signal.SIGSTOP)
    if under_way == "photo":
        show.service.photo(0, 0, NOTES)
    if under_way == "video":
        show.service.start_recording(0, show.time_us)
    process.kill()
    show.until(lambda: show.service._process is None)
    assert len(show.lost) == (under_way != "nothing")
    assert all("the picture process has ended before" in text for text in show.lost)
