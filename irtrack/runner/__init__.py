"""Runs of trackers in other processes: `pool`, its `worker` processes, and their `watchdog`.

`crash_reporter` serves the process that runs a tracker itself. This module imports nothing, since the crash reporter
must load fast.
"""
