"""WebSocket server of a source: frames, ground truth and tracks, played, paused and sought by viewers.

The messages are those of a recording, on the same topics. The package foxglove-sdk, an extra, serves them to Foxglove
and Lichtblick. Playback control needs a viewer that has it; others show the frames as they come.
"""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import socket
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from irsim.camera.agc import Agc, AgcSequence
from irsim.errors import InputError, expect_source
from irsim.live.playback import Playback, times_of
from irsim.recording.messages import (
    CAMERA,
    EPOCH_NS,
    IMAGE,
    PREVIEW,
    TRACK_STATE,
    TRUTH,
    TRUTH_BOXES,
    TRUTH_DESCRIPTOR,
    descriptor_set,
    encode_image,
    encode_truth,
    to_ns,
)
from irsim.recording.tracks import TrackState, annotate_tracks, encode_state, track_topics
from irsim.recording.viewer import annotate_truth
from irsim.recording.writer import default_agc, encode_calibration, encode_preview
from irsim.types import Frame, Source, Truth

HOST, PORT = "127.0.0.1", 8765
"""Default address: this machine only; the port that viewers propose."""


class Overlay(NamedTuple):
    """Tracks to show over the frames: name of the tracker, and its states for (counts, display, truth) of a frame."""

    name: str
    states: Callable[[Frame, Frame, Truth | None], Sequence[TrackState]]


class LiveServer:
    """Server of a source's frames in real time, for one viewer or several.

    It plays once the first viewer is there. InputError where foxglove-sdk is missing or the port is taken.
    """

    def __init__(self, source: Source, overlays: Sequence[Overlay] = (), host: str = HOST, port: int = PORT) -> None:
        expect_source("LiveServer", source)
        if importlib.util.find_spec("foxglove") is None:
            raise InputError("live: needs foxglove-sdk: pip install 'irtrack[live]'")
        check_port(host, port)
        self.source, self._overlays, self._host = source, tuple(overlays), host
        self._time_of = times_of(source)
        self.playback = Playback(len(source), self._time_of)
        agc = source.agc if isinstance(source.agc, Agc) else default_agc(source.bits)
        self._agc = AgcSequence(agc, source.bits, lambda index: source.frame(index).image)
        self._foxglove: Any = importlib.import_module("foxglove")
        self._context = self._foxglove.Context()
        self._channels = {topic: self._channel(topic, kind) for topic, kind in self._topics().items()}
        span = to_ns(self._time_of(0)), to_ns(self._time_of(len(source) - 1))
        new = "playback_time_range" in inspect.signature(self._foxglove.start_server).parameters
        self.has_playback_control = new
        capabilities = importlib.import_module("foxglove.websocket").Capability
        self._server: Any = self._foxglove.start_server(
            name=f"irsim live {source.name}",
            host=host,
            port=port,
            context=self._context,
            server_listener=_listener(self),
            capabilities=[capabilities.Time],
            **({"playback_time_range": span} if new else {}),
        )

    @property
    def url(self) -> str:
        """Address that a viewer opens."""
        return f"ws://{self._host}:{self._server.port}"

    def run(self, seconds: float | None = None) -> None:
        """Serve until `close`, or until no frame is due for `seconds`."""
        while (index := self.playback.next(seconds)) is not None:
            counts, truth = next(iter(self.source.pairs(index, index + 1)))
            for topic, data in self._messages(counts, truth):
                self._channels[topic].log(data, log_time=to_ns(counts.time))
            self._server.broadcast_time(to_ns(counts.time))
            if self.has_playback_control and self.playback.state.status == "ended":
                self._server.broadcast_playback_state(self.state())

    def serve(self) -> None:
        """Print the address and serve until Ctrl-C."""
        print(f"open {self.url} in Foxglove or Lichtblick (Foxglove WebSocket); Ctrl-C ends", flush=True)
        try:
            self.run()
        except KeyboardInterrupt:
            print("stopped")
        finally:
            self.close()

    def close(self) -> None:
        """End the server and `run`."""
        self.playback.stop()
        self._server.stop()

    def state(self, request: str | None = None, did_seek: bool = False, state: Any = None) -> Any:
        """Return the state of the playback as a message of foxglove-sdk."""
        websocket: Any = importlib.import_module("foxglove.websocket")
        now = state or self.playback.state
        return websocket.PlaybackState(
            status=getattr(websocket.PlaybackStatus, now.status.capitalize()),
            current_time=to_ns(self._time_of(now.index)),
            playback_speed=now.speed,
            did_seek=did_seek,
            request_id=request,
        )

    def _topics(self) -> dict[str, Any]:
        found: dict[str, Any] = {IMAGE: RawImage.DESCRIPTOR, PREVIEW: CompressedImage.DESCRIPTOR}
        if self.source.camera.ifov_rad is not None:
            found[CAMERA] = CameraCalibration.DESCRIPTOR
        if self.source.has_truth:
            found |= {TRUTH: TRUTH_DESCRIPTOR, TRUTH_BOXES: ImageAnnotations.DESCRIPTOR}
        for overlay in self._overlays:
            found |= zip(track_topics(overlay.name), (ImageAnnotations.DESCRIPTOR, TRACK_STATE), strict=True)
        return found

    def _channel(self, topic: str, kind: Any) -> Any:
        schema = self._foxglove.Schema(name=kind.full_name, encoding="protobuf", data=descriptor_set(kind))
        return self._foxglove.Channel(topic, schema=schema, message_encoding="protobuf", context=self._context)

    def _messages(self, counts: Frame, truth: Truth | None) -> Iterator[tuple[str, bytes]]:
        """Yield the topic and bytes of each message of a frame."""
        log_time = to_ns(counts.time)
        display = self._agc.display(counts)
        if CAMERA in self._channels and self.source.camera.ifov_rad is not None:
            yield CAMERA, encode_calibration(self.source.size, self.source.camera.ifov_rad, log_time)
        yield IMAGE, encode_image(counts.image, log_time)
        yield PREVIEW, encode_preview(display.image, log_time)
        if truth is not None:
            yield TRUTH, encode_truth(truth)
            yield TRUTH_BOXES, annotate_truth(truth, log_time)
        for overlay in self._overlays:
            states = overlay.states(counts, display, truth)
            boxes, track = track_topics(overlay.name)
            yield boxes, annotate_tracks(overlay.name, states, log_time)
            yield from ((track, encode_state(state)) for state in states)


def check_port(host: str, port: int) -> None:
    """Raise InputError where a port cannot be listened on; port 0 stands for any free one."""
    try:
        with socket.create_server((host, port)):
            pass
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"live: {host}:{port} cannot be listened on: {reason}; allowed: another port") from None


def _listener(live: LiveServer) -> Any:
    """Return the object whose methods foxglove-sdk calls, in threads of its own."""
    websocket: Any = importlib.import_module("foxglove.websocket")

    class Listener(websocket.ServerListener):  # type: ignore[misc]  # an extra
        def on_subscribe(self, client: Any, channel: Any) -> None:
            live.playback.begin()

        def on_playback_control_request(self, playback_control_request: Any) -> Any:
            request = playback_control_request
            play = request.playback_command == websocket.PlaybackCommand.Play
            seek = None if request.seek_time is None else (request.seek_time - EPOCH_NS) / 1e9
            state = live.playback.control(play, request.playback_speed, seek)
            return live.state(request.request_id, seek is not None, state)

    return Listener()
