"""The command `irsim`, also as `python -m irsim`."""

from __future__ import annotations

import sys

from irsim.signals import no_interrupt_lost


def main() -> None:
    """Run it; Ctrl-C is no error while it is still imported, nor before it answers for itself, either."""
    no_interrupt_lost()
    try:
        from irsim.cli.app import main as command

        command()
    except KeyboardInterrupt:
        print("irsim: stopped", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
