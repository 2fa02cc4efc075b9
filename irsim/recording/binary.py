"""How MCAP's records lie in a file, as its specification (mcap.dev/spec) has it."""

from __future__ import annotations

import struct

MAGIC = b"\x89MCAP0\r\n"

RECORD = struct.Struct("<BQ")
"""Opcode and length, before every record."""

MESSAGE = struct.Struct("<HIQQ")
"""Channel, sequence, log time, publish time, before a message's data."""

CHUNK_HEAD = struct.Struct("<QQQII")
"""Start time, end time, uncompressed size, its CRC, length of the compression's name, which follows."""

CRC = struct.Struct("<I")
"""A CRC-32, the last of the records that end in one."""
