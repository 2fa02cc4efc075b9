"""Images of one topic in a ROS 2 bag or in an MCAP file of another program."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice, pairwise
from pathlib import Path
from statistics import median
from typing import Any

from mcap.reader import NonSeekingReader

from irsim.config.base import suggestion
from irsim.config.paths import begins_as_recording
from irsim.errors import InputError, counted, one_line
from irsim.recording.image_messages import KINDS, check_rosbags, decoder, kind_of, picture_of, time_of
from irsim.recording.images import Picture, Pictures
from irsim.recording.mcap_reader import McapFile, open_mcap
from irsim.recording.mcap_records import BROKEN, packets
from irsim.recording.mcap_writer import LIBRARY

_METADATA = "metadata.yaml"
_HEAD = 1 << 12
"""Number of bytes in which a recording of irsim names its metadata."""
_TIMED = 64
"""Number of messages whose times give the frame rate."""

Logged = tuple[int, "bytes | memoryview"]
"""Log time, ns, and bytes of a message."""


@dataclass(frozen=True)
class Topic:
    """Topic of a file: type of its messages, their encoding, their number (None: not stated), and a function that
    yields them in order."""

    name: str
    schema: str
    encoding: str
    count: int | None
    read: Callable[[], Iterator[Logged]]

    def __str__(self) -> str:
        count = "" if self.count is None else f", {counted(self.count, 'message')}"
        return f"{one_line(self.name)} ({one_line(self.schema) or self.encoding}{count})"


def has_topics(path: Path) -> bool:
    """Return True for a ROS 2 bag, and for an MCAP file that irsim did not write."""
    if path.is_dir():
        return (path / _METADATA).is_file()
    if path.suffix.lower() == ".db3":
        return True
    if not begins_as_recording(path):
        return False
    with path.open("rb") as file:
        return LIBRARY.encode() not in file.read(_HEAD) and not _named_later(path)


def _named_later(path: Path) -> bool:
    """Return True where another program has copied a recording of irsim, with its metadata."""
    try:
        return any(entry.name.startswith(LIBRARY) for entry in open_mcap(path).metadata_index)
    except InputError:
        return False


def open_topic(path: Path, name: str | None = None) -> Pictures:
    """Open the images of a topic; without a name, of the only topic of images.

    The times of the messages (their own stamps, or log times where they have none) are kept, and the median of the
    first steps gives the frame rate. InputError where the topic is missing, or one of several must be named.
    """
    topics = bag_topics(path) if path.is_dir() or path.suffix.lower() == ".db3" else _mcap_topics(path)
    topic = _chosen(path, topics, name)
    kind = kind_of(topic.schema, topic.encoding)
    assert kind is not None
    messages = partial(_messages, topic, decoder(kind, str(path)))
    first = [time for time, _ in islice(messages(), _TIMED)]
    if not first:
        raise InputError(f"{path}: {one_line(topic.name)} holds no message; allowed: one or more")
    steps = [after - before for before, after in pairwise(first)]
    rate = float(f"{1e9 / median(steps):.6g}") if steps and median(steps) > 0 else None
    note = f"no rate was given: {rate:g} Hz, from the times of the messages, which are kept" if rate else None
    return Pictures(partial(_read, messages, first[0]), topic.count, rate, notes=(note,) if note else ())


def _chosen(path: Path, topics: list[Topic], name: str | None) -> Topic:
    """Return the topic of a name, or the only one with images. InputError, with the topics, for other names."""
    images = [each for each in topics if each.count != 0 and kind_of(each.schema, each.encoding)]
    if not images:
        found = ", ".join(map(str, topics)) or "none"
        raise InputError(f"{path}: holds no images ({', '.join(KINDS)}); its topics: {found}")
    if name is None and len(images) == 1:
        return images[0]
    names = [each.name for each in images]
    if name is None:
        found = ", ".join(map(str, images))
        raise InputError(f"{path}: holds {len(images)} topics of images: {found}; allowed: one of them (topic=NAME)")
    if name not in names:
        found = ", ".join(map(str, images))
        raise InputError(f"{path}: topic {name!r}: allowed: {found}{suggestion(name, names)}")
    return images[names.index(name)]


def _messages(topic: Topic, decode: Callable[[Any], Any]) -> Iterator[tuple[int, Any]]:
    """Yield the time, ns, and the decoded message of each image, in order. InputError where one cannot be decoded."""
    for number, (log_time, data) in enumerate(topic.read()):
        place = f"{one_line(topic.name)}: message {number}"
        try:
            message = decode(data)
        except Exception:  # rosbags documents no errors of damaged messages
            raise InputError(f"{place}: cannot be read as {topic.schema}") from None
        yield time_of(message) or log_time, (place, message)


def _read(messages: Callable[[], Iterator[tuple[int, Any]]], first: int) -> Iterator[Picture]:
    """Yield the pictures with their times after the first one, s."""
    for time, (place, message) in messages():
        yield picture_of(message, place, (time - first) / 1e9)


def _mcap_topics(path: Path) -> list[Topic]:
    """Return the topics of an MCAP file, with those that have several channels once for each schema."""
    mcap = open_mcap(path, remedy="mcap recover writes a whole file")
    schemas = {each.id: each.name for each in mcap.schemas}
    found: dict[tuple[str, str, str], set[int]] = {}
    for channel in mcap.channels:
        key = channel.topic, schemas.get(channel.schema_id, ""), channel.message_encoding
        found.setdefault(key, set()).add(channel.id)
    counts = mcap.message_counts
    number = (lambda ids: sum(counts.get(id, 0) for id in ids)) if counts else lambda ids: None
    read = _chunked if mcap.chunks else _unchunked
    return [Topic(*key, number(ids), partial(read, mcap, ids)) for key, ids in found.items()]


def _chunked(mcap: McapFile, channels: set[int]) -> Iterator[Logged]:
    """Yield the messages of channels, one chunk at a time. DamageError where a chunk does not match its CRC."""
    with mcap.open() as file:
        for chunk in mcap.chunks:
            if chunk.message_index_offsets and not channels & chunk.message_index_offsets.keys():
                continue
            data = mcap.chunk_data(file, chunk)
            with mcap.decoding("the messages of a chunk cannot be read"):
                there = [each for channel in channels for each in packets(data, channel)]
            for packet in sorted(there, key=lambda each: each.log_time):
                yield packet.log_time, packet.data


def _unchunked(mcap: McapFile, channels: set[int]) -> Iterator[Logged]:
    """Yield the messages of channels in a file without chunks, in its order."""
    with mcap.open() as file:
        reading = NonSeekingReader(file).iter_messages(log_time_order=False)
        try:
            for _, channel, message in reading:
                if channel.id in channels:
                    yield message.log_time, message.data
        except BROKEN:
            raise mcap.damage_error("its messages cannot be read") from None


def bag_topics(path: Path) -> list[Topic]:
    """Return the topics of a ROS 2 bag: the folder with metadata.yaml, or one .db3 file."""
    check_rosbags(str(path))
    with _bag(path) as bag:
        return [
            Topic(name, topic.msgtype or "", "cdr", topic.msgcount, partial(_of_bag, path, name))
            for name, topic in bag.topics.items()
        ]


def _of_bag(path: Path, name: str) -> Iterator[Logged]:
    with _bag(path) as bag:
        wanted = [each for each in bag.connections if each.topic == name]
        reading = iter(bag.messages(wanted))
        while True:
            try:
                _, log_time, data = next(reading)
            except StopIteration:
                return
            except Exception as error:
                raise _unreadable(path, error) from None
            yield log_time, data


def _bag(path: Path) -> Any:
    """Return the reader of a bag, as a context manager. InputError where it cannot be opened."""
    rosbag2: Any = importlib.import_module("rosbags.rosbag2")  # an extra
    try:
        bag = rosbag2.Reader(path)
        bag.open()
        bag.close()
    except Exception as error:  # rosbags documents no errors of damaged files
        raise _unreadable(path, error) from None
    return bag


def _unreadable(path: Path, error: Exception) -> InputError:
    return InputError(f"{path}: is not a whole ROS 2 bag: {one_line(str(error)) or type(error).__name__}")
