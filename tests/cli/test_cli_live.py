"""irsim live and irtrack live as processes: a viewer gets frames and tracks; Ctrl-C ends them with status 0."""

from __future__ import annotations

import asyncio
import json
import signal
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations

import irtrack

pytest.importorskip("foxglove")
websocket: Any = pytest.importorskip("tornado.websocket")
httpclient: Any = pytest.importorskip("tornado.httpclient")

SCENE = """\
frames: 12
camera: {size: [48, 40], rate_hz: 50}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [10, 20], speed: 1, range_m: 1500}}
"""


async def messages_of(url: str, topic: str, count: int) -> list[tuple[int, bytes]]:
    """Return the first messages of a topic by log time, as a viewer gets them."""
    socket = await websocket.websocket_connect(httpclient.HTTPRequest(url), subprotocols=["foxglove.sdk.v1"])
    ids: list[int] = []
    while not ids:
        text = json.loads(await socket.read_message())
        ids = [each["id"] for each in text.get("channels", ()) if each["topic"] == topic]
    wanted = [{"id": 7, "channelId": ids[0]}]
    await socket.write_message(json.dumps({"op": "subscribe", "subscriptions": wanted}))
    found: list[tuple[int, bytes]] = []
    while len(found) < count:
        data = await socket.read_message()
        if isinstance(data, bytes) and data[0] == 1:
            found.append((struct.unpack_from("<IQ", data, 1)[1], data[13:]))
    socket.close()
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "topic"),
    [
        (["irsim", "live", "s.yaml"], "/truth/annotations"),
        (["irtrack", "live", "kalman", "s.yaml", "--seed", "0"], "/tracks/kalman/annotations"),
    ],
)
def test_viewer_of_a_command(words: list[str], topic: str, tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(SCENE)
    command = [sys.executable, "-m", *words, "--port", "0"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith("open ws://127.0.0.1:"), line
        found = asyncio.run(asyncio.wait_for(messages_of(line.split()[1], topic, 12), 60))
        process.send_signal(signal.SIGINT)
        rest, errors = process.communicate(timeout=30)
    finally:
        process.kill()
    assert (process.returncode, rest, errors) == (0, "stopped\n", "")
    track = irtrack.run("kalman", tmp_path / "s.yaml")
    centers = [annotation.texts[0].text for annotation in (ImageAnnotations.FromString(data) for _, data in found)]
    if "tracks" in topic:
        assert centers == [f"kalman {status}" for status in track.statuses]
    else:
        assert all(text.startswith("jet  SCR ") for text in centers)
    times = [log_time for log_time, _ in found]
    assert [round((time - times[0]) / 2e7) for time in times] == list(range(12))
