"""Recordings: what is written comes back, other tools read it, and damage is always noticed."""

from __future__ import annotations

import io
import json
import pickle
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from mcap.reader import SeekingReader
from mcap.records import Chunk, DataEnd
from mcap.stream_reader import StreamReader, breakup_chunk

import irsim
from irsim.display import AGCS
from irsim.errors import InputError
from irsim.recording import (
    TrackHeader,
    TrackState,
    open_recording,
    read_tracks,
    record,
    recover,
    write_tracks,
)
from irsim.recording.times import EPOCH_NS, from_ns, to_ns
from irsim.types import Box, Frame, Input, Source, TargetTruth, Truth

FULL = TargetTruth(
    id="jet",
    center=(10.123456789012345, 7.0),
    box=Box(10.25, 7.0, 8.5, 6.0),
    cls="body",
    signal_center=(10.5, 7.25),
    velocity=(1.5, -0.25),
    attitude=(10.0, -5.0, 180.0),
    range_m=2500.5,
    visible=0.75,
    occluders=("pole", "cloud"),
    crossing=False,
    in_view=True,
    contrast_k=-3.5,
)
BARE = TargetTruth(id="dot", center=(3.0, 4.0), box=Box(3.0, 4.0, 2.0, 2.0), accuracy_px=1.0)


@dataclass(frozen=True)
class Noise:
    """A source of random pictures whose truth has every field or hardly any; `jet` is absent at times."""

    count: int = 7
    size: tuple[int, int] = (32, 24)
    bits: int = 14
    has_truth: bool = True
    follow: str | None = "dot"
    name: str = "noise"
    hash: str = "abc"
    rate_hz: float = 30.0
    seed: int = 0

    def __len__(self) -> int:
        return self.count

    def frame(self, index: int, input: Input = "counts") -> Frame:
        dtype = np.uint8 if self.bits <= 8 else np.uint16
        rng = np.random.default_rng((self.seed, index))
        image = rng.integers(0, 2**self.bits, self.size[::-1]).astype(dtype)
        return Frame(image, index, index / self.rate_hz, self.bits)

    def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        yield from (self.frame(index) for index in range(start, self.count if stop is None else stop))

    def truths(self, start: int = 0, stop: int | None = None) -> Iterator[Truth]:
        for index in range(start, self.count if stop is None else stop):
            yield Truth(index, index / self.rate_hz, (BARE,) if index % 3 == 2 else (FULL, BARE))


def same_frames(first: Iterator[Frame], second: Iterator[Frame]) -> bool:
    return all(
        one.index == other.index
        and one.time == other.time
        and one.bits == other.bits
        and one.image.dtype == other.image.dtype
        and np.array_equal(one.image, other.image)
        for one, other in zip(first, second, strict=True)
    )


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(Noise(), tmp_path_factory.mktemp("rec") / "noise.mcap")


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
@pytest.mark.parametrize("bits", [8, 14, 16])
def test_frames_and_truth_come_back_bit_for_bit(tmp_path: Path, bits: int, compression: str) -> None:
    source = Noise(bits=bits)
    recording = open_recording(record(source, tmp_path / "r.mcap", compression=compression))  # type: ignore[arg-type]
    assert isinstance(recording, Source)
    assert (recording.size, recording.bits, recording.rate_hz, len(recording)) == ((32, 24), bits, 30.0, 7)
    assert same_frames(recording.frames(), source.frames())
    assert list(recording.truths()) == list(source.truths())


def test_a_frame_alone_is_the_frame_in_sequence(recorded: Path) -> None:
    recording, source = open_recording(recorded), Noise()
    for index in (6, 0, 3, 2):
        assert same_frames(iter([recording.frame(index)]), iter([source.frame(index)]))
    assert same_frames(recording.frames(start=3, stop=6), source.frames(start=3, stop=6))
    assert list(recording.truths(3, 6)) == list(source.truths(3, 6))
    assert list(recording.frames(start=5, stop=99))[-1].index == 6
    for index in (7, -1):
        with pytest.raises(IndexError, match="allowed: 0 to 6"):
            recording.frame(index)


def test_display_is_the_agc_of_the_counts(tmp_path: Path, recorded: Path) -> None:
    recording = open_recording(recorded)
    linear = AGCS.parse({"kind": "linear"})
    for counts, display in zip(recording.frames("counts"), recording.frames("display"), strict=True):
        assert display.bits == 8
        assert display.image.dtype == np.uint8
        assert np.array_equal(display.image, linear.display(counts.image, 14))  # type: ignore[attr-defined]
    shallow = open_recording(record(Noise(bits=8), tmp_path / "r.mcap"))
    assert same_frames(shallow.frames("display"), shallow.frames("counts"))


def test_the_recorded_agc_is_used(tmp_path: Path) -> None:
    @dataclass(frozen=True)
    class Shown(Noise):
        agc = AGCS.parse({"kind": "fixed", "low": 1000, "high": 9000})

    recording = open_recording(record(Shown(), tmp_path / "r.mcap"))
    assert recording.agc == Shown.agc
    wanted = Shown.agc.display(Noise().frame(2).image, 14)  # type: ignore[attr-defined]
    assert np.array_equal(recording.frame(2, "display").image, wanted)


def test_without_truth(tmp_path: Path) -> None:
    recording = open_recording(record(Noise(has_truth=False, follow=None), tmp_path / "r.mcap"))
    assert not recording.has_truth
    assert list(recording.truths()) == []
    assert recording.targets == ()
    assert recording.follow is None
    assert len(list(recording.frames())) == 7


def test_targets_and_whom_to_follow(tmp_path: Path, recorded: Path) -> None:
    recording = open_recording(recorded)
    assert recording.targets == ("jet", "dot")
    assert recording.follow == "dot"
    jet, _ = recording.contents.targets
    assert (jet.cls, jet.first, jet.frames) == ("body", 0, 5)  # absent in frames 2 and 5
    assert open_recording(record(Noise(follow=None), tmp_path / "r.mcap")).follow == "jet"


def test_a_part_of_a_source_keeps_its_times(tmp_path: Path) -> None:
    recording = open_recording(record(Noise(), tmp_path / "r.mcap", start=2, stop=5))
    assert [frame.index for frame in recording.frames()] == [0, 1, 2]
    assert [frame.time for frame in recording.frames()] == [2 / 30, 3 / 30, 4 / 30]
    assert [truth.time for truth in recording.truths()] == [2 / 30, 3 / 30, 4 / 30]
    assert np.array_equal(recording.frame(0).image, Noise().frame(2).image)
    assert recording.header.first_frame == 2


def test_a_recording_of_a_recording_is_the_same_file(tmp_path: Path, recorded: Path) -> None:
    copy = record(open_recording(recorded), tmp_path / "copy.mcap")
    assert copy.read_bytes() == recorded.read_bytes()


def test_the_hash_tells_recordings_apart(tmp_path: Path, recorded: Path) -> None:
    again = record(Noise(), tmp_path / "again.mcap")
    other = record(Noise(seed=1), tmp_path / "other.mcap")
    assert open_recording(again).hash == open_recording(recorded).hash
    assert open_recording(other).hash != open_recording(recorded).hash


@pytest.mark.parametrize("rate", [9.0, 25.0, 29.97, 30.0, 50.0, 1000 / 7, 10_000.0])
def test_regular_times_survive_whole_nanoseconds(rate: float) -> None:
    for index in (0, 1, 2, 3, 7, 1000, 999_999):
        assert from_ns(to_ns(index / rate), rate) == index / rate


def test_irregular_times_keep_their_nanoseconds() -> None:
    assert from_ns(to_ns(0.123456789), 30.0) == 0.123456789
    assert to_ns(0.0) == EPOCH_NS


def test_it_pickles(recorded: Path) -> None:
    again = pickle.loads(pickle.dumps(open_recording(recorded)))
    assert same_frames(again.frames(), Noise().frames())
    assert again.agc == open_recording(recorded).agc


def test_a_file_changed_behind_its_back_is_refused(tmp_path: Path) -> None:
    path = record(Noise(), tmp_path / "r.mcap")
    recording = open_recording(path)
    record(Noise(seed=1), path)
    with pytest.raises(InputError, match="changed after it was opened"):
        recording.frame(0)


# What others see


def test_the_plain_reader_sees_the_topics_with_their_schemas(recorded: Path) -> None:
    with recorded.open("rb") as file:
        reader = SeekingReader(file, validate_crcs=True)
        seen = {}
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
            assert message.log_time == message.publish_time == EPOCH_NS + round(message.sequence / 30 * 1e9)
            seen.setdefault(channel.topic, (schema.name, []))[1].append(message.sequence)
        header = reader.get_header()
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attachments = {record.name: record.data for record in reader.iter_attachments()}
    everything = list(range(7))
    assert header.profile == ""
    assert seen == {
        "/ir/image": ("foxglove.RawImage", everything),
        "/ir/preview": ("foxglove.CompressedImage", everything),
        "/truth/annotations": ("foxglove.ImageAnnotations", everything),
        "/truth/targets": ("irsim.Truth", everything),
    }
    assert metadata["irsim"]["name"] == "noise"
    assert json.loads(metadata["irsim"]["size"]) == [32, 24]
    assert json.loads(metadata["irsim"]["agc"])["kind"] == "linear"
    layout = json.loads(attachments["layout.json"])
    assert layout["configById"]["Image!counts"]["imageMode"]["imageTopic"] == "/ir/image"


def test_truth_decodes_with_nothing_but_the_embedded_schema(recorded: Path) -> None:
    with recorded.open("rb") as file:
        schema, _, message = next(SeekingReader(file).iter_messages(topics=["/truth/targets"]))
    assert schema is not None
    pool = DescriptorPool()
    for proto in FileDescriptorSet.FromString(schema.data).file:
        pool.Add(proto)
    truth = GetMessageClass(pool.FindMessageTypeByName("irsim.Truth")).FromString(message.data)
    jet = truth.targets[0]  # type: ignore[attr-defined]
    assert (jet.id, jet.center.x, jet.visible) == ("jet", FULL.center[0], 0.75)
    assert list(jet.occluders) == ["pole", "cloud"]


def test_viewers_can_link_every_embedded_schema(recorded: Path) -> None:
    with recorded.open("rb") as file:
        summary = SeekingReader(file).get_summary()
    assert summary is not None
    for schema in summary.schemas.values():
        pool = DescriptorPool()
        for proto in FileDescriptorSet.FromString(schema.data).file:
            pool.Add(proto)  # raises where an import is missing
        assert pool.FindMessageTypeByName(schema.name).full_name == schema.name


@pytest.mark.parametrize(("bits", "encoding", "dtype"), [(8, "mono8", "u1"), (14, "mono16", "<u2")])
def test_images_are_foxglove_raw_images(tmp_path: Path, bits: int, encoding: str, dtype: str) -> None:
    path = record(Noise(bits=bits), tmp_path / "r.mcap")
    with path.open("rb") as file:
        messages = list(SeekingReader(file).iter_messages(topics=["/ir/image", "/ir/preview"]))
    channel = next(channel for _, channel, _ in messages if channel.topic == "/ir/image")
    assert channel.metadata["bits"] == str(bits)
    assert int(channel.metadata["display_low"]) < int(channel.metadata["display_high"]) < 2**bits
    image = RawImage.FromString(next(m.data for _, c, m in messages if c.topic == "/ir/image"))
    itemsize = np.dtype(dtype).itemsize
    assert (image.width, image.height, image.encoding, image.step) == (32, 24, encoding, 32 * itemsize)
    assert np.array_equal(np.frombuffer(image.data, dtype).reshape(24, 32), Noise(bits=bits).frame(0).image)
    preview = CompressedImage.FromString(next(m.data for _, c, m in messages if c.topic == "/ir/preview"))
    assert preview.format == "jpeg"
    assert preview.data.startswith(b"\xff\xd8\xff")  # JPEG's start of image


def test_annotations_count_from_the_pixels_corner(recorded: Path) -> None:
    with recorded.open("rb") as file:
        _, _, message = next(SeekingReader(file).iter_messages(topics=["/truth/annotations"]))
    annotations = ImageAnnotations.FromString(message.data)
    (loop,) = annotations.points
    assert loop.type == PointsAnnotation.LINE_LOOP
    # The box 10.25 +- 8.5/2, 7 +- 6/2 from pixel centres is half a pixel more from the corner.
    corners = [(point.x, point.y) for point in loop.points]
    assert corners == [(6.5, 4.5), (15.0, 4.5), (15.0, 10.5), (6.5, 10.5)]
    (circle,) = annotations.circles  # the 2 px target: a box would cover it
    assert (circle.position.x, circle.position.y) == (3.5, 4.5)
    assert [text.text for text in annotations.texts] == ["jet", "dot"]


def test_chunks_are_small_whole_and_of_one_sort(recorded: Path) -> None:
    data = recorded.read_bytes()
    topics: list[list[str]] = []
    names: dict[int, str] = {}
    for item in StreamReader(io.BytesIO(data), emit_chunks=True, validate_crcs=True).records:
        if isinstance(item, DataEnd):
            assert item.data_section_crc != 0
        if isinstance(item, Chunk):
            assert item.uncompressed_crc != 0
            inside = breakup_chunk(item, validate_crc=True)
            names |= {part.id: part.topic for part in inside if hasattr(part, "topic")}
            topics.append([names[part.channel_id] for part in inside if hasattr(part, "channel_id")])
    images = [chunk for chunk in topics if "/ir/image" in chunk]
    assert [len(chunk) for chunk in images] == [2, 2, 2, 1]
    assert all(set(chunk) == {"/ir/image"} for chunk in images)


def test_a_calibrated_camera(tmp_path: Path) -> None:
    class Geometry:
        ifov_rad = 0.0005

    class Camera:
        geometry, band, range_k = Geometry, "mwir", (220.0, 400.0)

    class Scene:
        camera = Camera

    @dataclass(frozen=True)
    class Calibrated(Noise):
        scenario = Scene
        scenario_text = "seed: 3\n"

    path = record(Calibrated(), tmp_path / "r.mcap")
    with path.open("rb") as file:
        ((_, _, message),) = SeekingReader(file).iter_messages(topics=["/ir/camera_info"])
    camera = CameraCalibration.FromString(message.data)
    assert list(camera.K) == [2000, 0, 15.5, 0, 2000, 11.5, 0, 0, 1]  # 1/IFOV; the middle of 32 x 24
    recording = open_recording(path)
    assert recording.scenario_text == "seed: 3\n"
    assert recording.header.range_k == (220.0, 400.0)


def test_info_is_json(recorded: Path) -> None:
    facts = json.loads(json.dumps(open_recording(recorded).info()))
    assert facts["frames"] == 7
    assert facts["duration_s"] == pytest.approx(7 / 30)
    assert facts["source_hash"] == "abc"


# What goes wrong


def one_line(error: pytest.ExceptionInfo[InputError], path: Path) -> str:
    text = str(error.value)
    assert "\n" not in text
    assert str(path) in text
    return text


@pytest.mark.parametrize(
    ("content", "says"),
    [(None, "no such file"), (b"", "is empty"), (b"PK\x03\x04 something else", "not an MCAP file")],
)
def test_files_that_are_no_recording(tmp_path: Path, content: bytes | None, says: str) -> None:
    path = tmp_path / "x.mcap"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError) as error:
        open_recording(path)
    assert says in one_line(error, path)


def test_a_folder_is_no_recording(tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        open_recording(tmp_path)
    assert "is a folder" in one_line(error, tmp_path)


def test_somebody_elses_mcap(tmp_path: Path) -> None:
    from mcap.writer import Writer

    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/x", "json", 0)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    with pytest.raises(InputError, match="not a recording of irsim") as error:
        open_recording(path)
    one_line(error, path)


def test_cut_anywhere_it_says_how_much_is_left_and_recovers_it(tmp_path: Path, recorded: Path) -> None:
    data = recorded.read_bytes()
    path, out = tmp_path / "cut.mcap", tmp_path / "out.mcap"
    kept = set()
    for length in np.linspace(1, len(data) - 1, 60).astype(int):
        path.write_bytes(data[:length])
        with pytest.raises(InputError) as error:
            open_recording(path)
        text = one_line(error, path)
        if "nothing can be" in text:
            with pytest.raises(InputError):
                recover(path, out)
            assert not out.exists()
            continue
        left = int(text.split("; ")[1].split()[0])
        kept.add(left)
        rescued = open_recording(recover(path, out))
        assert len(rescued) == left
        assert same_frames(rescued.frames(), Noise().frames(stop=left))
        assert list(rescued.truths()) == list(Noise().truths(stop=left))
        out.unlink()
    assert kept == {2, 4, 6, 7}  # whole chunks of two, and the last


def test_a_flipped_byte_is_an_error_or_changes_nothing(tmp_path: Path, recorded: Path) -> None:
    data = recorded.read_bytes()
    path = tmp_path / "flipped.mcap"
    rng = np.random.default_rng(1)
    said: list[str] = []
    for position in np.sort(rng.choice(len(data), 800, replace=False)):
        damaged = bytearray(data)
        damaged[position] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            recording = open_recording(path)
            frames, truths = list(recording.frames()), list(recording.truths())
            facts = (recording.follow, recording.agc, recording.targets)
        except InputError as error:
            said.append(str(error))
        else:
            assert same_frames(iter(frames), Noise().frames())
            assert truths == list(Noise().truths())
            assert facts == ("dot", AGCS.parse({"kind": "linear"}), ("jet", "dot"))
    assert len(said) > 200
    assert not any("\n" in text for text in said)


def test_recovery_keeps_what_stands_behind_a_broken_chunk(tmp_path: Path, recorded: Path) -> None:
    data = bytearray(recorded.read_bytes())
    needle = Noise().frame(2).image.tobytes()
    data[data.find(needle) + 10] ^= 1
    path = tmp_path / "broken.mcap"
    path.write_bytes(data)
    recording = open_recording(path)
    assert same_frames(recording.frames(stop=2), Noise().frames(stop=2))
    with pytest.raises(InputError, match="does not match its CRC") as error:
        recording.frame(2)
    one_line(error, path)
    rescued = open_recording(recover(path, tmp_path / "out.mcap"))
    assert [round(frame.time * 30) for frame in rescued.frames()] == [0, 1, 4, 5, 6]
    assert [frame.index for frame in rescued.frames()] == [0, 1, 2, 3, 4]
    assert rescued.contents.notes == ("5 frames recovered from broken.mcap",)


def test_outputs_are_checked_before_any_work(tmp_path: Path) -> None:
    class Untouched(Noise):
        def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
            raise AssertionError("worked before the output was checked")

    with pytest.raises(InputError, match="does not exist"):
        record(Untouched(), tmp_path / "nowhere" / "r.mcap")
    with pytest.raises(InputError, match="is a folder"):
        record(Untouched(), tmp_path)
    for start, stop in ((0, 8), (3, 3), (-1, 2), (7, None)):
        with pytest.raises(InputError, match=r"allowed: within 0:7"):
            record(Untouched(), tmp_path / "r.mcap", start, stop)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_recording_leaves_what_was_there(tmp_path: Path) -> None:
    class Breaks(Noise):
        def frame(self, index: int, input: Input = "counts") -> Frame:
            if index == 4:
                raise RuntimeError("the camera fell off")
            return super().frame(index)

    path = tmp_path / "r.mcap"
    path.write_bytes(b"precious")
    with pytest.raises(RuntimeError, match="fell off"):
        record(Breaks(), path)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == b"precious"


def test_frames_of_another_size_are_refused(tmp_path: Path) -> None:
    class Changes(Noise):
        def frame(self, index: int, input: Input = "counts") -> Frame:
            return replace(super().frame(index), image=np.zeros((24, 30 + 2 * (index < 3)), np.uint16))

    with pytest.raises(ValueError, match="expected a 32x24"):
        record(Changes(), tmp_path / "r.mcap")
    assert list(tmp_path.iterdir()) == []


# Tracks

STATES = (
    TrackState(0, 0.0, Box(5.0, 6.0, 8.0, 8.0), "tracking"),
    TrackState(1, 1 / 30, Box(5.5, 6.0, 8.0, 8.0), "occluded", 0.5, (1.0, -2.0), ((1.0, 0.1), (0.1, 2.0)), 37.5),
    TrackState(3, 3 / 30, Box(6.0, 6.0, 3.0, 3.0), "lost", score=0.0),
)
TRACK = TrackHeader(tracker="grey:n=50", source="noise", source_hash="abc", rate_hz=30.0, target="jet")


def test_tracks_come_back(tmp_path: Path) -> None:
    track = read_tracks(write_tracks(tmp_path / "noise.grey.mcap", TRACK, STATES))
    assert track.states == STATES
    assert track.header == TRACK.model_copy(update={"states": 3})


def test_tracks_lie_beside_their_source(tmp_path: Path, recorded: Path) -> None:
    path = write_tracks(tmp_path / "noise.grey.mcap", TRACK, STATES)
    with path.open("rb") as file:
        messages = list(SeekingReader(file, validate_crcs=True).iter_messages())
    topics = {(channel.topic, schema.name) for schema, channel, _ in messages if schema is not None}
    assert topics == {
        ("/tracks/grey_n_50/annotations", "foxglove.ImageAnnotations"),
        ("/tracks/grey_n_50/states", "irsim.TrackState"),
    }
    with recorded.open("rb") as file:
        times = {m.sequence: m.log_time for _, _, m in SeekingReader(file).iter_messages(topics=["/ir/image"])}
    assert all(message.log_time == times[message.sequence] for _, _, message in messages)


def test_tracks_and_recordings_are_told_apart(tmp_path: Path, recorded: Path) -> None:
    path = write_tracks(tmp_path / "t.mcap", TRACK, STATES)
    with pytest.raises(InputError, match="holds a track, not frames"):
        open_recording(path)
    with pytest.raises(InputError, match="not a track recording"):
        read_tracks(recorded)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match="cut short"):
        read_tracks(path)


def test_public_names() -> None:
    assert irsim.open_recording is open_recording
    assert irsim.record is record
