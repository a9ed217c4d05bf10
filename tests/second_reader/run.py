#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What is read from a damaged recording is what a second reader, written apart, reads.

    run.py PROGRAM SCRATCH [MUTATIONS] [SEED]

Recordings of one topic /joint_states are written by the program and, without any checksum, by this script: MCAP and
SQLite. Bytes of them are changed, erased, doubled and cut off. Where `convert` takes such a file, every row has to be
a message of the file, as the reader of this script decodes it, with the distances in time of their stamps; where rows
are fewer than messages that can be read, time goes backwards or is that of recording, that has to be said. Of recordings
with checksums every row has to be a message of the undamaged file, unless it is said to be read without one. What the
second reader cannot judge (another message definition, packed chunks) is counted.
"""

import csv
import math
import random
import sqlite3
import struct
import subprocess
import sys
from pathlib import Path

TOPIC, TYPE = "/joint_states", "sensor_msgs/msg/JointState"
NAMES = ("right_wheel", "left_wheel")
DEFINITION = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
MAGIC = b"\x89MCAP0\r\n"
ROWS = 120
CHANGES = ("flip", "set", "erase", "double", "cut", "number")


class Unreadable(Exception):
    pass


# CDR of JointState, by hand.


def encode(stamp_ns, velocity, effort):
    data = bytearray(b"\x00\x01\x00\x00")

    def align(size):
        data.extend(b"\x00" * (-(len(data) - 4) % size))

    def text(value):
        align(4)
        data.extend(struct.pack("<I", len(value) + 1) + value.encode() + b"\x00")

    data.extend(struct.pack("<iI", stamp_ns // 10**9, stamp_ns % 10**9))
    text("")
    align(4)
    data.extend(struct.pack("<I", len(NAMES)))
    for name in NAMES:
        text(name)
    for values in ((), velocity, effort):
        align(4)
        data.extend(struct.pack("<I", len(values)))
        if values:
            align(8)
            data.extend(struct.pack(f"<{len(values)}d", *values))
    return bytes(data)


class Cdr:
    def __init__(self, data):
        if len(data) < 4 or data[0] != 0 or data[1] not in (0, 1):
            raise Unreadable
        self.order, self.data, self.at = "><"[data[1]], data[4:], 0

    def numbers(self, code, count=1):
        size = struct.calcsize("=" + code)
        if count:
            self.at += -self.at % size
        if self.at + size * count > len(self.data):
            raise Unreadable
        values = struct.unpack_from(f"{self.order}{count}{code}", self.data, self.at)
        self.at += size * count
        return values

    def text(self):
        size = self.numbers("I")[0]
        if size == 0 or self.at + size > len(self.data):
            raise Unreadable
        value = self.data[self.at:self.at + size - 1]
        self.at += size
        return value


def decode(data):
    """(stamp in ns, omega_r, omega_l, tau_r, tau_l)"""
    cdr = Cdr(data)
    seconds, nanoseconds = cdr.numbers("i")[0], cdr.numbers("I")[0]
    cdr.text()
    count = cdr.numbers("I")[0]
    if count > len(data):
        raise Unreadable
    names = [cdr.text() for _ in range(count)]
    arrays = []
    for _ in range(3):
        count = cdr.numbers("I")[0]
        if count > len(data):
            raise Unreadable
        arrays.append(cdr.numbers("d", count))
    try:
        right, left = (names.index(name.encode()) for name in NAMES)
        values = (arrays[1][right], arrays[1][left], arrays[2][right], arrays[2][left])
    except (ValueError, IndexError) as wrong:
        raise Unreadable from wrong
    return (seconds * 10**9 + nanoseconds, *values)


def decoded(messages):
    """Those that can be, as decode()."""
    result = []
    for data in messages:
        try:
            result.append(decode(data))
        except Unreadable:
            pass
    return result


# MCAP without checksums, and its reader.


def string(value):
    return struct.pack("<I", len(value)) + value


def record(code, content):
    return struct.pack("<BQ", code, len(content)) + content


def write_mcap(path, messages, chunked):
    schema = record(3, struct.pack("<H", 1) + string(TYPE.encode()) + string(b"ros2msg") + string(DEFINITION.encode()))
    channel = record(4, struct.pack("<HH", 1, 1) + string(TOPIC.encode()) + string(b"cdr") + struct.pack("<I", 0))
    records = [record(5, struct.pack("<HIQQ", 1, k, stamp, stamp) + data) for k, (stamp, data) in enumerate(messages)]
    content = [schema, channel]
    if chunked:
        for first in range(0, len(records), 20):
            inside, last = b"".join(records[first:first + 20]), min(first + 19, len(records) - 1)
            head = struct.pack("<QQQI", messages[first][0], messages[last][0], len(inside), 0)
            content.append(record(6, head + string(b"") + struct.pack("<Q", len(inside)) + inside))
    else:
        content += records
    path.write_bytes(MAGIC + record(1, string(b"ros2") + string(b"another writer")) + b"".join(content)
                     + record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + MAGIC)


def mcap_records(data):
    at = 0
    while at + 9 <= len(data):
        code, size = struct.unpack_from("<BQ", data, at)
        if size > len(data) - at - 9:
            return
        yield code, data[at + 9:at + 9 + size]
        at += 9 + size


def take_string(data, at):
    size = struct.unpack_from("<I", data, at)[0]
    if at + 4 + size > len(data):
        raise Unreadable
    return data[at + 4:at + 4 + size], at + 4 + size


def read_mcap(path):
    """Messages' data, in their order; Unreadable where schema or channel are not those that were written."""
    messages, known = [], {}

    def walk(part):
        for code, content in mcap_records(part):
            if code == 3:
                number = struct.unpack_from("<H", content)[0]
                name, at = take_string(content, 2)
                encoding, at = take_string(content, at)
                text, _ = take_string(content, at)
                known["schema", number] = (name, encoding, text) == (TYPE.encode(), b"ros2msg", DEFINITION.encode())
            elif code == 4:
                number, schema = struct.unpack_from("<HH", content)
                topic, at = take_string(content, 4)
                encoding, _ = take_string(content, at)
                ours = (topic, encoding) == (TOPIC.encode(), b"cdr")
                known["channel", number] = ours and known.get(("schema", schema), False)
            elif code == 5 and len(content) >= 22:
                channel = struct.unpack_from("<H", content)[0]
                if known.get(("channel", channel), False):
                    messages.append(content[22:])
            elif code == 6:
                compression, at = take_string(content, 28)
                size = struct.unpack_from("<Q", content, at)[0]
                if compression == b"":
                    walk(content[at + 8:at + 8 + size])

    try:
        walk(path.read_bytes()[len(MAGIC):])
    except (struct.error, Unreadable) as wrong:
        raise Unreadable from wrong
    if not any(known.values()):
        raise Unreadable
    return messages


def anywhere(path):
    """What looks like a message record at any place of an MCAP file that is not packed."""
    data, at, found = path.read_bytes(), -1, []
    while (at := data.find(b"\x05", at + 1)) >= 0:
        size = int.from_bytes(data[at + 1:at + 9], "little")
        if 22 <= size <= len(data) - at - 9:
            found.append(data[at + 31:at + 9 + size])
    return found


# SQLite, through Python's own module.


def write_db3(path, messages):
    path.unlink(missing_ok=True)
    database = sqlite3.connect(path)
    database.executescript("""
        CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
        CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
        CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
          serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
          data BLOB NOT NULL);
        CREATE INDEX timestamp_idx ON messages (timestamp ASC);
        INSERT INTO schema VALUES (3, 'humble');""")
    database.execute("INSERT INTO topics VALUES (1, ?, ?, 'cdr', '')", (TOPIC, TYPE))
    database.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (1, ?, ?)", messages)
    database.commit()
    database.close()


def read_db3(path):
    try:
        database = sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True)
        database.text_factory = bytes
        topics = database.execute("SELECT id, name, type, serialization_format FROM topics").fetchall()
        ours = [number for number, *rest in topics if rest == [TOPIC.encode(), TYPE.encode(), b"cdr"]]
        if not ours:
            raise Unreadable
        # By rows and not by the index on times, which a change may have put out of step with them.
        rows = database.execute("SELECT topic_id, data FROM messages NOT INDEXED").fetchall()
    except (sqlite3.Error, OverflowError, UnicodeDecodeError) as wrong:  # messages of SQLite have bytes of the file
        raise Unreadable from wrong
    return [data for topic, data in rows if topic in ours and isinstance(data, bytes)]


# Comparison.


def rows_of(path):
    with path.open(encoding="utf-8") as file:
        return [tuple(float(row[name]) if row[name] else math.nan for name in ("t", "omega_r", "omega_l", "tau_r", "tau_l"))
                for row in csv.DictReader(line for line in file if line.strip())]


def judge(rows, messages, readable, said):
    """What is wrong, or None. `messages`: (stamp, values...); `readable` of them can be read, `said` is what was told."""
    stamps = {}
    for stamp, *values in messages:
        stamps.setdefault(tuple(value if math.isfinite(value) else None for value in values), set()).add(stamp)
    origins, before = None, -math.inf
    for k, (t, *values) in enumerate(rows):
        here = {stamp - round(t * 1e9) for stamp in stamps.get(tuple(x if math.isfinite(x) else None for x in values), ())}
        rounding = 2 + 2e9 * math.ulp(t)
        origins = here if origins is None else {a for a in origins if any(abs(a - b) <= rounding for b in here)}
        if not here:
            return f"row {k + 1} {t, *values} is no message"
        if not origins and "the time of recording is used" not in said:
            return f"row {k + 1} {t, *values} is at another time than its message"
        if not t > before and "time goes backwards" not in said:
            return f"row {k + 1} {t, *values} is not later than the row before"
        before = t
    losses = [line for line in said.splitlines() if line.startswith("log: ") and "times are counted from" not in line]
    if len(rows) < readable and not losses:
        return f"{len(rows)} rows of {readable} messages, and nothing was said"
    return None


def mutated(data, draw):
    data = bytearray(data)
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        kind, at, size = draw.choice(CHANGES), draw.randrange(len(data)), draw.choice((1, 2, 4, 8, 24, 100))
        if kind == "flip":
            data[at] ^= 1 << draw.randrange(8)
        elif kind == "set":
            data[at] = draw.choice((0, 1, 0x7F, 0x80, 0xFF))
        elif kind == "erase":
            del data[at:at + size]
        elif kind == "double":
            data[at:at] = data[at:at + size]
        elif kind == "number":
            value = draw.choice((0, 1, 0x7FFFFFFF, 0xFFFFFFFF, 2**63, draw.getrandbits(32)))
            data[at:at + 8] = struct.pack("<Q", value)[:len(data[at:at + 8])]
        elif draw.random() < 0.2:
            del data[at:]
        if not data:
            data.append(0)
    return bytes(data)


def convert(program, log, out):
    out.unlink(missing_ok=True)
    return subprocess.run([program, "convert", log, out], capture_output=True, text=True, errors="replace", timeout=60,
                          check=False)


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__.strip())
    program, scratch = str(Path(sys.argv[1]).resolve()), Path(sys.argv[2])
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 120
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    scratch.mkdir(parents=True, exist_ok=True)
    draw = random.Random(seed)
    truth = [(1_700_000_000 * 10**9 + k * 10_000_000, *(draw.uniform(-9.0, 9.0) for _ in range(4))) for k in range(ROWS)]
    messages = [(stamp, encode(stamp, values[:2], values[2:])) for stamp, *values in truth]
    table = scratch / "seed.csv"
    table.write_text("t,omega_r,omega_l,tau_r,tau_l\n" + "".join(
        f"{(stamp - truth[0][0]) * 1e-9:.9f}," + ",".join(map(repr, values)) + "\n" for stamp, *values in truth))

    seeds = {}  # name: path, reader, whether it has checksums
    for name, chunked in (("bare.mcap", False), ("chunks.mcap", True)):
        seeds[name] = scratch / name, read_mcap, False
        write_mcap(seeds[name][0], messages, chunked)
    seeds["rows.db3"] = scratch / "rows.db3", read_db3, False
    write_db3(seeds["rows.db3"][0], messages)
    of_ours = {"ours.mcap": ["--compression", "none"], "packed.mcap": ["--compression", "zstd"], "ours.db3": []}
    for name, options in of_ours.items():
        path = scratch / name
        subprocess.run([program, "convert", table, path, "--force", "--quiet", *options], check=True)
        seeds[name] = path, (read_db3 if name.endswith("db3") else read_mcap), name.endswith("mcap")

    print(f"seed {seed}, {count} changes each\n{'recording':12} {'refused':>8} {'read':>6} {'whole':>6} {'no judge':>9}")
    failures = []
    for name, (path, reader, checked) in seeds.items():
        if name == "packed.mcap":
            healthy = [(stamp - truth[0][0], *values) for stamp, *values in truth]
        else:
            healthy = decoded(reader(path))
        out = scratch / "out.csv"
        done = convert(program, path, out)
        if done.returncode != 0 or len(healthy) != ROWS or [row[1:] for row in rows_of(out)] != [row[1:] for row in truth]:
            sys.exit(f"second reader: {name}: not read as it was written: {done.stderr}")
        tally = {"refused": 0, "read": 0, "whole": 0, "no judge": 0}
        for k in range(count):
            damaged = scratch / f"damaged{path.suffix}"
            damaged.write_bytes(mutated(path.read_bytes(), draw))
            done = convert(program, damaged, out)
            if done.returncode == 2 and not out.exists():
                tally["refused"] += 1
                continue
            if done.returncode != 0:
                failures.append((name, k, f"exit code {done.returncode}: {done.stderr[-300:]}", damaged.read_bytes()))
                continue
            rows = rows_of(out)
            try:
                second = decoded(reader(damaged))
            except Unreadable:
                tally["no judge"] += 1
                second = None
            sure = checked and "without a checksum" not in done.stdout
            if second is None and not sure:
                continue
            tally["read"] += 1
            tally["whole"] += len(rows) == ROWS
            # Behind damage the program goes on at the next sound record, where this reader has lost the thread.
            known = healthy if sure else second + (decoded(anywhere(damaged)) if reader is read_mcap else [])
            wrong = judge(rows, known, len(second or ()), done.stdout)
            if wrong:
                failures.append((name, k, wrong, damaged.read_bytes()))
        print(f"{name:12} {tally['refused']:8} {tally['read']:6} {tally['whole']:6} {tally['no judge']:9}", flush=True)
    for number, (name, k, wrong, data) in enumerate(failures):
        kept = scratch / f"failed-{number}{Path(name).suffix}"
        kept.write_bytes(data)
        print(f"{name}, change {k}: {wrong}; kept as {kept}")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
