"""How a take's file is laid out: its chunks, counted without reading them."""

import struct
from collections import Counter
from pathlib import Path

MAGIC = 8
RECORD = struct.Struct("<BQ")
CHUNK, DATA_END, FOOTER = 0x06, 0x0F, 0x02
CHUNK_HEAD = struct.Struct("<QQQII")  # start, end, uncompressed size, CRC, length of the compression's name


def chunk_counts(path: Path) -> dict[str, int]:
    """How many chunks are compressed in which way, "none" among them; as far as the file goes.  Raises OSError."""
    counts: Counter[str] = Counter()
    size = path.stat().st_size
    with path.open("rb") as file:
        at = MAGIC
        while at + RECORD.size <= size:
            file.seek(at)
            kind, length = RECORD.unpack(file.read(RECORD.size))
            at += RECORD.size + length
            if kind in (DATA_END, FOOTER) or at > size:
                break
            if kind == CHUNK and length >= CHUNK_HEAD.size:
                *_, name_length = CHUNK_HEAD.unpack(file.read(CHUNK_HEAD.size))
                counts[file.read(min(name_length, 32)).decode("ascii", "replace") or "none"] += 1
    return dict(sorted(counts.items()))
