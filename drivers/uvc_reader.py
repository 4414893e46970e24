"""A thread that reads an opened USB camera without pause."""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from queue import Empty, SimpleQueue

from drivers.pairing import TimedPicture
from drivers.uvc_camera import UvcCamera
from navapp.errors import DeviceLost, NavappError

Task = tuple[Callable[[UvcCamera], float], "Future[float]"]


class UvcReader:
    """Grabs without pause, so that no picture waits in the driver; closes the camera at its end.

    OpenCV's capture object must not be used by two threads: controls are set by this one.
    """

    def __init__(
        self,
        camera: UvcCamera,
        on_picture: Callable[[TimedPicture], None],
        on_failure: Callable[[Exception], None],
    ) -> None:
        """Start.

        Args:
            camera: opened; it belongs to the thread from now on.
            on_picture: called in the thread with each new picture.
            on_failure: called in the thread, once, when the camera is lost.
        """
        self.camera = camera
        self._on_picture, self._on_failure = on_picture, on_failure
        self._tasks: SimpleQueue[Task] = SimpleQueue()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="uvc-reader", daemon=True)
        self._thread.start()

    def ask(self, action: Callable[[UvcCamera], float], timeout_s: float) -> float:
        """Do something with the camera between two pictures, and return its answer.

        Raises:
            TimeoutError: it is not done within the time.
            NavappError: whatever the action raises; DeviceLost when the thread has ended.
        """
        future: Future[float] = Future()
        self._tasks.put((action, future))
        if not self._thread.is_alive():
            self._refuse_tasks()
        return future.result(timeout_s)

    def stop(self) -> None:
        """Ask it to end; returns at once."""
        self._stopping.set()

    def join(self, timeout_s: float) -> bool:
        """Wait for the end; False when a grab still blocks it."""
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            while not self._stopping.is_set():
                self._do_tasks()
                picture = self.camera.grab()
                if picture is not None:
                    self._on_picture(picture)
        except NavappError as error:
            self._on_failure(error)
        except Exception as error:  # noqa: BLE001 (a bug must end as a lost camera, not as a silent thread)
            lost = DeviceLost(f"camera {self.camera.identity.serial} failed: {error}")
            lost.__cause__ = error
            self._on_failure(lost)
        finally:
            self.camera.close()
            self._refuse_tasks()

    def _do_tasks(self) -> None:
        for action, future in self._take_tasks():
            try:
                future.set_result(action(self.camera))
            except Exception as error:  # noqa: BLE001 (belongs to the one who asked)
                future.set_exception(error)

    def _refuse_tasks(self) -> None:
        for _, future in self._take_tasks():
            future.set_exception(DeviceLost(f"camera {self.camera.identity.serial} is closed"))

    def _take_tasks(self) -> list[Task]:
        tasks: list[Task] = []
        while True:
            try:
                tasks.append(self._tasks.get_nowait())
            except Empty:
                return tasks
