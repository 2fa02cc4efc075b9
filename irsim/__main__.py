"""The command `irsim`, also as `python -m irsim`."""

from __future__ import annotations

from irsim.errors import run_command


def main() -> None:
    """Run the command `irsim`."""
    run_command("irsim", "irsim.cli.app")


if __name__ == "__main__":
    main()
