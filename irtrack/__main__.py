"""The command `irtrack`, also as `python -m irtrack`."""

from __future__ import annotations

from irsim.errors import run_command


def main() -> None:
    """Run the command."""
    run_command("irtrack", "irtrack.cli.app")


if __name__ == "__main__":
    main()
