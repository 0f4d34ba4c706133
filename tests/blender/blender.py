"""The real Blender as a command: its own user folder, a deadline on every call, what it printed."""

import os
import shlex
import subprocess
from dataclasses import dataclass
from pathlib import Path

SCRIPTS = Path(__file__).parent / "scripts"


@dataclass(frozen=True)
class Blender:
    """A Blender that keeps everything of its user in `resources`, so that the tester's own stays untouched."""

    command: tuple[str, ...]
    resources: Path

    @classmethod
    def from_environment(cls, resources: Path) -> "Blender":
        """The command in the variable BLENDER, as a shell would split it; KeyError where it is not set."""
        return cls(tuple(shlex.split(os.environ["BLENDER"])), resources)

    @property
    def environment(self) -> dict[str, str]:
        """The variables that Blender is started with."""
        return os.environ | {"BLENDER_USER_RESOURCES": str(self.resources)}

    def run(self, *arguments: str | Path, timeout: float = 120, status: int = 0) -> subprocess.CompletedProcess[str]:
        """Run to the end; AssertionError with all output where the exit status is not `status`."""
        done = subprocess.run(
            [*self.command, *map(str, arguments)],
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=timeout,
        )
        assert done.returncode == status, f"exit status {done.returncode}\n{done.stdout}\n{done.stderr}"
        return done

    def script(self, name: str, *arguments: str | Path, blend: Path | None = None, timeout: float = 120) -> str:
        """Run a file of `scripts` in the background, over `blend` if given; what it printed. Its errors are errors."""
        opened = [] if blend is None else [blend]
        done = self.run(
            "--background",
            *opened,
            "--python-exit-code",
            "1",
            "--python",
            SCRIPTS / name,
            "--",
            *arguments,
            timeout=timeout,
        )
        return done.stdout
