"""What an export left out or approximated, told once each. No bpy."""


class Notes:
    """Collects warnings, one line each, in the order they first came up."""

    def __init__(self) -> None:
        self._lines: dict[str, None] = {}

    def add(self, line: str) -> None:
        """Keep a line unless it is already there."""
        self._lines.setdefault(line)

    def lines(self) -> tuple[str, ...]:
        """All lines, each once."""
        return tuple(self._lines)
