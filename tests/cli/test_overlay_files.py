"""Pictures and videos of the overlay: whole or not at all."""

from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from navapp.cli.overlay_files import OverlayFolder, OverlayVideo
from navapp.errors import InputError


def result(index: int, height: int = 96, width: int = 128) -> SimpleNamespace:
    """A frame that shows a picture of its sequence: smooth, and different from the others."""
    x, y = np.meshgrid(np.linspace(0, 200, width), np.linspace(0, 200, height))
    image = np.stack([x, y, np.full_like(x, 20.0 * index)], axis=-1).astype(np.uint8)
    return SimpleNamespace(frame=SimpleNamespace(index=index), picture=SimpleNamespace(image=image))


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def fail_after(writer: OverlayFolder | OverlayVideo) -> None:
    """One frame, then an error."""
    writer.add(result(1))
    raise RuntimeError


class TestFolder:
    def test_names_hold_the_frame_and_the_picture_of_the_sequence(self, tmp_path: Path) -> None:
        with OverlayFolder(tmp_path / "o", is_lossless=True) as folder:
            for index in (*range(5), *range(3, 0, -1), 2, 3, 4, 3, 3):
                folder.add(result(index))
        found = names(tmp_path / "o")
        assert found[0] == "overlay_00000_0000.png"
        assert found[-1] == "overlay_00012_0003.png"
        assert len(found) == 13
        assert names(tmp_path) == ["o"]

    def test_png_is_lossless_and_jpeg_nearly(self, tmp_path: Path) -> None:
        for is_lossless, suffix, most in ((True, "png", 0), (False, "jpg", 8)):
            with OverlayFolder(tmp_path / suffix, is_lossless=is_lossless) as folder:
                folder.add(result(4))
            image = cv2.imread(str(tmp_path / suffix / f"overlay_00000_0004.{suffix}"))
            off = np.abs(image.astype(int) - result(4).picture.image)
            assert off.max() <= most

    def test_what_is_in_the_folder_stays(self, tmp_path: Path) -> None:
        (tmp_path / "o").mkdir()
        (tmp_path / "o" / "notes.txt").write_text("x")
        with OverlayFolder(tmp_path / "o") as folder:
            folder.add(result(1))
        assert names(tmp_path / "o") == ["notes.txt", "overlay_00000_0001.jpg"]

    def test_an_error_leaves_nothing_behind(self, tmp_path: Path) -> None:
        folder = OverlayFolder(tmp_path / "o")
        with pytest.raises(RuntimeError), folder:
            fail_after(folder)
        assert names(tmp_path) == []

    @pytest.mark.parametrize("target", ["file", "file/inside"])
    def test_a_file_is_no_folder(self, tmp_path: Path, target: str) -> None:
        (tmp_path / "file").write_text("x")
        with pytest.raises(InputError, match="overlay folder") as error:
            OverlayFolder(tmp_path / target)
        assert "--overlay" in str(error.value.remedy)
        assert names(tmp_path) == ["file"]


class TestVideo:
    def read(self, path: Path) -> list[np.ndarray]:
        video = cv2.VideoCapture(str(path))
        frames = []
        while True:
            is_read, image = video.read()
            if not is_read:
                break
            frames.append(image)
        video.release()
        return frames

    @pytest.mark.parametrize("shape", [(240, 320), (181, 321)])
    def test_all_frames_are_in_it_with_the_mark(self, tmp_path: Path, shape) -> None:
        path = tmp_path / "new" / "o.mp4"
        with OverlayVideo(path, 15.0) as video:
            for index in range(7):
                video.add(result(index, *shape))
        frames = self.read(path)
        assert len(frames) == 7
        for index, image in enumerate(frames):
            height, width = image.shape[:2]
            assert abs(height - shape[0]) <= 1
            assert abs(width - shape[1]) <= 1
            plain = result(index, *shape).picture.image[:height, :width]
            off = np.abs(image.astype(int) - plain)
            assert np.median(off[40:]) < 6
            # The mark, in the upper right corner: lighter than anything there.
            assert image[:40, width // 2 :].min(axis=2).max() > 150
            assert plain[:40].min(axis=2).max() < 130
        assert names(tmp_path / "new") == ["o.mp4"]

    def test_its_rate_is_that_of_the_sequence(self, tmp_path: Path) -> None:
        with OverlayVideo(tmp_path / "o.mp4", 12.5) as video:
            for index in range(5):
                video.add(result(index))
        opened = cv2.VideoCapture(str(tmp_path / "o.mp4"))
        assert opened.get(cv2.CAP_PROP_FPS) == pytest.approx(12.5)
        opened.release()

    def test_an_error_leaves_nothing_behind_and_the_old_one_in_place(self, tmp_path: Path) -> None:
        path = tmp_path / "o.mp4"
        path.write_bytes(b"old")
        video = OverlayVideo(path, 15.0)
        with pytest.raises(RuntimeError), video:
            fail_after(video)
        assert names(tmp_path) == ["o.mp4"]
        assert path.read_bytes() == b"old"

    def test_without_frames_there_is_no_video(self, tmp_path: Path) -> None:
        with OverlayVideo(tmp_path / "o.mp4", 15.0):
            pass
        assert names(tmp_path) == []

    @pytest.mark.parametrize("target", ["o.avi", "o", "file/o.mp4", "folder.mp4"])
    def test_what_cannot_be_a_video_is_refused_before_the_first_frame(
        self, tmp_path: Path, target: str
    ) -> None:
        (tmp_path / "file").write_text("x")
        (tmp_path / "folder.mp4").mkdir()
        with pytest.raises(InputError, match="video") as error:
            OverlayVideo(tmp_path / target, 15.0)
        assert error.value.remedy
        assert names(tmp_path) == ["file", "folder.mp4"]
