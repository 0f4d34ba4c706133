"""Long work in a daemon thread: what a run, a comparison and a study have in common. No bpy."""

import threading
from abc import ABC, abstractmethod
from typing import Self


class Background(ABC):
    """Work that one thread does while others watch it; a subclass says what to do and how it is cancelled."""

    def __init__(self, name: str) -> None:
        self.error: BaseException | None = None
        self._thread = threading.Thread(target=self._guarded, name=name, daemon=True)

    def start(self) -> Self:
        """Start the thread and return at once."""
        self._thread.start()
        return self

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the thread has ended, at most `timeout` seconds. True when it has."""
        self._thread.join(timeout)
        return self.done

    @property
    def done(self) -> bool:
        """True when the thread was started and has ended, for whatever reason."""
        return self._thread.ident is not None and not self._thread.is_alive()

    @property
    @abstractmethod
    def cancelled(self) -> bool:
        """True when it was cancelled before it was finished."""

    def raise_error(self) -> None:
        """Raise what ended the thread early, if anything but a cancel did."""
        if self.error is not None and not self.cancelled:
            raise self.error

    @abstractmethod
    def _work(self) -> None:
        """Do it, in the thread."""

    def _guarded(self) -> None:
        try:
            self._work()
        except BaseException as error:  # noqa: BLE001 - handed to the thread that waits, see raise_error
            self.error = error
