"""The command `irtrack`, also as `python -m irtrack`."""

from __future__ import annotations

import sys

from irsim.__main__ import keep_interrupts


def main() -> None:
    """Run it; Ctrl-C is no error while it is still imported, nor before it answers for itself, either."""
    keep_interrupts()
    try:
        from irtrack.cli import main as command

        command()
    except KeyboardInterrupt:
        print("irtrack: stopped", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
