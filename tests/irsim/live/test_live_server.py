"""A viewer's side of the live server: what arrives over the WebSocket, by value."""

from __future__ import annotations

import asyncio
import json
import struct
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations

import irsim
from irsim.errors import InputError
from irsim.live import LiveServer, Overlay
from irsim.recording.messages import EPOCH_NS, IMAGE, TRUTH, TRUTH_BOXES, decode_image, decode_truth

pytest.importorskip("foxglove")
websocket: Any = pytest.importorskip("tornado.websocket")
httpclient: Any = pytest.importorskip("tornado.httpclient")

SCENE = """\
seed: 3
frames: 30
camera: {size: [48, 40], rate_hz: 50, netd_mk: 40}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [10, 20], speed: 0.5, range_m: 1500}}
"""
MESSAGE, STATE = 1, 5
"""First bytes of the server's messages and playback states (Foxglove SDK protocol)."""
PLAY, PAUSE = 0, 1


@pytest.fixture
def recording(tmp_path: Path) -> irsim.Recording:
    return irsim.open_recording(irsim.record(irsim.Rendering(irsim.loads(SCENE)), tmp_path / "r.mcap"))


@pytest.fixture
def serve() -> Iterator[Callable[..., LiveServer]]:
    servers, threads = [], []

    def start(source: irsim.Source, overlays: Sequence[Overlay] = ()) -> LiveServer:
        servers.append(server := LiveServer(source, overlays, port=0))
        threads.append(thread := threading.Thread(target=server.run, daemon=True))
        thread.start()
        return server

    yield start
    for server, thread in zip(servers, threads, strict=True):
        server.close()
        thread.join(10)
        assert not thread.is_alive()


class Viewer:
    """Client that subscribes to topics and keeps what comes."""

    def __init__(self, socket: Any) -> None:
        self.socket = socket
        self.topics: dict[int, str] = {}
        self.info: dict[str, Any] = {}
        self.messages: list[tuple[str, int, bytes]] = []
        self.states: list[tuple[Any, ...]] = []

    async def advertised(self, count: int) -> None:
        while len(self.topics) < count:
            text = json.loads(await self.socket.read_message())
            if text["op"] == "serverInfo":
                self.info = text
            self.topics |= {each["id"]: each["topic"] for each in text.get("channels", ())}

    async def subscribe(self, *topics: str) -> None:
        ids = [{"id": channel, "channelId": channel} for channel, topic in self.topics.items() if topic in topics]
        await self.socket.write_message(json.dumps({"op": "subscribe", "subscriptions": ids}))

    async def control(self, command: int, speed: float, seek: int | None = None) -> None:
        packed = struct.pack("<BBfBQI", 3, command, speed, seek is not None, seek or 0, 2)
        await self.socket.write_message(packed + b"id", binary=True)

    async def until(self, enough: Callable[[], bool]) -> None:
        while not enough():
            data = await asyncio.wait_for(self.socket.read_message(), 10)
            if isinstance(data, bytes) and data[0] == MESSAGE:
                channel, log_time = struct.unpack_from("<IQ", data, 1)
                self.messages.append((self.topics[channel], log_time, data[13:]))
            elif isinstance(data, bytes) and data[0] == STATE:
                self.states.append(struct.unpack_from("<BQfB", data, 1))

    def of(self, topic: str) -> list[tuple[int, bytes]]:
        return [(log_time, data) for each, log_time, data in self.messages if each == topic]


def view(server: LiveServer, work: Callable[[Viewer], Any], count: int) -> Viewer:
    async def connected() -> Viewer:
        request = httpclient.HTTPRequest(server.url)
        socket = await websocket.websocket_connect(request, subprotocols=["foxglove.sdk.v1"], max_message_size=1 << 26)
        viewer = Viewer(socket)
        await viewer.advertised(count)
        await work(viewer)
        socket.close()
        return viewer

    return asyncio.run(asyncio.wait_for(connected(), 30))


def test_frames_and_truth_arrive_by_value(recording: irsim.Recording, serve: Callable[..., LiveServer]) -> None:
    async def watch(viewer: Viewer) -> None:
        await viewer.subscribe(IMAGE, TRUTH)
        await viewer.until(lambda: len(viewer.of(TRUTH)) >= 30 and bool(viewer.states))

    viewer = view(serve(recording), watch, 5)
    assert "playbackControl" in viewer.info["capabilities"]
    at = {log_time: decode_image(memoryview(data)) for log_time, data in viewer.of(IMAGE)}
    for frame, truth in recording.pairs():
        log_time = EPOCH_NS + round(frame.time * 1e9)
        assert np.array_equal(at[log_time], frame.image)
        assert decode_truth(dict(viewer.of(TRUTH))[log_time], frame.index, frame.time) == truth
    status, time, speed, _ = viewer.states[-1]
    assert (status, time, speed) == (3, EPOCH_NS + round(29 / 50 * 1e9), 1.0)  # ended


def test_viewer_pauses_and_seeks(recording: irsim.Recording, serve: Callable[..., LiveServer]) -> None:
    wanted = EPOCH_NS + round(20 / 50 * 1e9)

    async def watch(viewer: Viewer) -> None:
        await viewer.control(PAUSE, 1.0)
        await viewer.subscribe(IMAGE)
        await viewer.until(lambda: len(viewer.of(IMAGE)) == 1)  # paused: the first one only
        await viewer.control(PAUSE, 2.0, wanted)
        await viewer.until(lambda: len(viewer.of(IMAGE)) == 2)
        await viewer.control(PLAY, 2.0)
        await viewer.until(lambda: len(viewer.of(IMAGE)) == 4)

    viewer = view(serve(recording), watch, 5)
    shown = [round((log_time - EPOCH_NS) * 50 / 1e9) for log_time, _ in viewer.of(IMAGE)]
    assert shown == [0, 20, 21, 22]
    assert (1, wanted, 2.0, 1) in viewer.states  # paused there, after a seek


def test_tracks_are_shown_beside_the_truth(recording: irsim.Recording, serve: Callable[..., LiveServer]) -> None:
    def states(counts: irsim.Frame, display: irsim.Frame, truth: irsim.Truth | None) -> list[irsim.TrackState]:
        assert (display.bits, display.index) == (8, counts.index)
        assert truth is not None
        return [irsim.TrackState(counts.index, counts.time, truth.targets[0].box, "tracking")]

    topic = "/tracks/my_tracker/annotations"

    async def watch(viewer: Viewer) -> None:
        await viewer.subscribe(TRUTH_BOXES, topic)
        await viewer.until(lambda: len(viewer.of(topic)) >= 3)

    viewer = view(serve(recording, [Overlay("my tracker", states)]), watch, 7)
    boxes, truth = (ImageAnnotations.FromString(viewer.of(name)[0][1]) for name in (topic, TRUTH_BOXES))
    assert boxes.points[0].points == truth.points[0].points
    assert boxes.texts[0].text == "my tracker tracking"


def test_taken_port_is_one_line(recording: irsim.Recording, serve: Callable[..., LiveServer]) -> None:
    port = int(serve(recording).url.rpartition(":")[2])
    with pytest.raises(
        InputError, match=rf"^live: 127\.0\.0\.1:{port} cannot be listened on: .*; allowed: another port"
    ):
        LiveServer(recording, port=port)
    with pytest.raises(InputError, match="cannot be listened on"):
        LiveServer(recording, host="no.such.host.invalid")
