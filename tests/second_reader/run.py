#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What is read from a damaged recording is what a second reader, written apart, reads.

    run.py PROGRAM SCRATCH [MUTATIONS] [SEED] [RECORDING...]

Recordings of a topic /joint_states are written by the program and, without any checksum, by this script: MCAP and
SQLite, with speeds or angles, either order of bytes, other topics between; and HDF5 (hdf5.py). Bytes of them are
changed, erased, doubled and cut off. Where `convert` takes such a file, every row has to be a message of the file, as
the reader of this script decodes it, with the distances in time of their stamps; where rows are fewer than messages
that can be read, columns are missing, time goes backwards or is that of recording, that has to be said. Of recordings
with checksums every row has to be a message of the undamaged file, unless it is said to be read without one. What the
second reader cannot judge (another message definition, packed chunks, unusual HDF5) is counted.
"""

import csv
import math
import random
import sqlite3
import struct
import subprocess
import sys
from functools import partial
from pathlib import Path

import hdf5

SPEEDS, ANGLES = ("omega_r", "omega_l", "tau_r", "tau_l"), ("phi_r", "phi_l", "tau_r", "tau_l")
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


def encode(stamp_ns, position, velocity, effort, order="<", names=NAMES):
    data = bytearray([0, order == "<", 0, 0])

    def align(size):
        data.extend(b"\x00" * (-(len(data) - 4) % size))

    def text(value):
        align(4)
        data.extend(struct.pack(order + "I", len(value) + 1) + value.encode() + b"\x00")

    data.extend(struct.pack(order + "iI", stamp_ns // 10**9, stamp_ns % 10**9))
    text("")
    align(4)
    data.extend(struct.pack(order + "I", len(names)))
    for name in names:
        text(name)
    for values in (position, velocity, effort):
        align(4)
        data.extend(struct.pack(order + "I", len(values)))
        if values:
            align(8)
            data.extend(struct.pack(f"{order}{len(values)}d", *values))
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
    """(stamp in ns, what it has of phi, omega and tau by name)"""
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
    found = {}
    for name, side in zip(NAMES, "rl"):
        if name.encode() not in names:
            raise Unreadable
        at = names.index(name.encode())
        found.update({f"{column}_{side}": values[at] for column, values in zip(("phi", "omega", "tau"), arrays)
                      if at < len(values)})
    return seconds * 10**9 + nanoseconds, found


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


def write_mcap(path, messages, chunked, others=()):
    """`others`: (topic, type, definition, data of a message that comes before each of `messages`)"""
    content, between = [], []
    for number, (topic, kind, definition, data) in enumerate(((TOPIC, TYPE, DEFINITION, b""), *others), 1):
        content.append(record(3, struct.pack("<H", number) + string(kind.encode()) + string(b"ros2msg")
                              + string(definition.encode())))
        content.append(record(4, struct.pack("<HH", number, number) + string(topic.encode()) + string(b"cdr")
                              + struct.pack("<I", 0)))
        if data:
            between.append((number, data))
    records = []
    for stamp, data in messages:
        records.append(b"".join(record(5, struct.pack("<HIQQ", number, len(records), stamp, stamp) + message)
                                for number, message in (*between, (1, data))))
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


def write_db3(path, messages, others=()):
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
    for number, (topic, kind, _, _) in enumerate(others, 2):
        database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", (number, topic, kind))
    for stamp, data in messages:
        for number, message in (*((number, other[3]) for number, other in enumerate(others, 2)), (1, data)):
            database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)",
                             (number, stamp, message))
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
    """Names of columns behind the time, and rows of numbers with the time in front."""
    with path.open(encoding="utf-8") as file:
        reader = csv.DictReader(line for line in file if line.strip())
        rows = [tuple(float(value) if value else math.nan for value in row.values()) for row in reader]
        return tuple(reader.fieldnames[1:]), rows


def columns_of(read):
    """Messages of columns, a row each."""
    names = [name for name in read if name != "t"]
    return [(round(t * 1e9), dict(zip(names, values))) for t, *values in zip(read["t"], *(read[name] for name in names))
            if math.isfinite(t)]


def key(names, values, said):
    """What values have to be equal; of angles, once it is said that whole turns were undone, without those."""
    turned = "by a whole turn undone" in said
    return tuple(None if not math.isfinite(value)
                 else round(value % (2 * math.pi) * 1e6) % round(2e6 * math.pi) if turned and name.startswith("phi")
                 else value
                 for name, value in zip(names, values))


def judge(names, rows, messages, readable, said):
    """What is wrong, or None. `messages`: (stamp, values by name); the first `readable` of them, as one reads on, stand
    in rows; `said` is what was told."""
    missing = [name for name in (messages[0][1] if readable else ()) if name not in names and name not in said
               and all(name in values for _, values in messages[:readable])]
    if missing:
        return f"no column {missing}, and nothing was said"
    readable = sum(all(name in values for name in names) for _, values in messages[:readable])
    stamps = {}
    for stamp, by_name in messages:
        if not all(name in by_name for name in names):
            continue
        stamps.setdefault(key(names, (by_name[name] for name in names), said), set()).add(stamp)
    origins, before = None, -math.inf
    for k, (t, *values) in enumerate(rows):
        here = {stamp - round(t * 1e9) for stamp in stamps.get(key(names, values, said), ())}
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
    wanted = sys.argv[5:]
    scratch.mkdir(parents=True, exist_ok=True)
    draw = random.Random(seed)
    stamps = [1_700_000_000 * 10**9 + k * 10_000_000 for k in range(ROWS)]
    truth = {"t": [k * 0.01 for k in range(ROWS)]} | {
        name: [draw.uniform(-9.0, 9.0) for _ in range(ROWS)] for name in SPEEDS}
    truth |= {name: [speed * t for t in truth["t"]] for name, speed in zip(ANGLES[:2], (7.0, -2.0))}
    pair = lambda name, k: (truth[name + "_r"][k], truth[name + "_l"][k])
    speeds = lambda order: [(stamp, encode(stamp, (), pair("omega", k), pair("tau", k), order))
                            for k, stamp in enumerate(stamps)]
    messages = speeds("<")
    angles = [(stamp, encode(stamp, pair("phi", k), (), pair("tau", k))) for k, stamp in enumerate(stamps)]
    others = (("/arm/joint_states", TYPE, DEFINITION, encode(stamps[0], (0.5,), (0.25,), (), "<", ("elbow",))),
              ("/chatter", "std_msgs/msg/String", "string data\n", b"\x00\x01\x00\x00\x03\x00\x00\x00hi\x00"))
    table_of = lambda columns: {name: truth[name] for name in ("t", *columns)}
    table = scratch / "seed.csv"
    table.write_text("t," + ",".join(SPEEDS) + "\n" + "".join(
        f"{t:.9f}," + ",".join(repr(truth[name][k]) for name in SPEEDS) + "\n" for k, t in enumerate(truth["t"])))

    def recorded(read, path):
        return decoded(read(path))

    def stored(group, path):
        try:
            return columns_of(hdf5.read(path, group))
        except hdf5.Unreadable as wrong:
            raise Unreadable from wrong

    mcap, db3 = partial(recorded, read_mcap), partial(recorded, read_db3)
    seeds = {}  # name: path, reader, whether it has checksums, columns
    for name, columns, reader, write in (
            ("bare.mcap", SPEEDS, mcap, lambda path: write_mcap(path, messages, False)),
            ("chunks.mcap", SPEEDS, mcap, lambda path: write_mcap(path, messages, True)),
            ("big.mcap", SPEEDS, mcap, lambda path: write_mcap(path, speeds(">"), True)),
            ("angles.mcap", ANGLES, mcap, lambda path: write_mcap(path, angles, False)),
            ("topics.mcap", SPEEDS, mcap, lambda path: write_mcap(path, messages, True, others)),
            ("rows.db3", SPEEDS, db3, lambda path: write_db3(path, messages)),
            ("topics.db3", ANGLES, db3, lambda path: write_db3(path, angles, others)),
            ("plain.h5", SPEEDS, partial(stored, b""), lambda path: hdf5.write(path, table_of(SPEEDS))),
            ("pieces.h5", ANGLES, partial(stored, b""), lambda path: hdf5.write(path, table_of(ANGLES), 40))):
        seeds[name] = scratch / name, reader, False, columns
        write(seeds[name][0])
    of_ours = {"ours.mcap": ["--compression", "none"], "packed.mcap": ["--compression", "zstd"],
               "lz4.mcap": ["--compression", "lz4"], "ours.db3": [], "ours.h5": []}
    for name, options in of_ours.items():
        path = scratch / name
        subprocess.run([program, "convert", table, path, "--force", "--quiet", *options], check=True)
        reader = {".mcap": mcap, ".db3": db3, ".h5": partial(stored, b"log")}[path.suffix]
        seeds[name] = path, reader, name.endswith("mcap"), SPEEDS

    print(f"seed {seed}, {count} changes each\n"
          f"{'recording':12} {'refused':>8} {'read':>6} {'whole':>6} {'no judge':>9}")
    failures = []
    for name, (path, reader, checked, columns) in seeds.items():
        if wanted and name not in wanted:
            continue
        if name in ("packed.mcap", "lz4.mcap"):
            healthy = columns_of(table_of(columns))
        else:
            healthy = reader(path)
        out = scratch / "out.csv"
        done = convert(program, path, out)
        names, rows = rows_of(out) if done.returncode == 0 else ((), [])
        expected = [tuple(truth[name][k] for name in names) for k in range(ROWS)]
        if set(names) != set(columns) or len(healthy) != ROWS or [row[1:] for row in rows] != expected:
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
            names, rows = rows_of(out)
            try:
                second = reader(damaged)
            except Unreadable:
                tally["no judge"] += 1
                second = None
            sure = checked and "without a checksum" not in done.stdout
            if second is None and not sure:
                continue
            tally["read"] += 1
            tally["whole"] += len(rows) == ROWS
            # Behind damage the program goes on at the next sound record, where this reader has lost the thread.
            known = healthy if sure else second + (decoded(anywhere(damaged)) if reader is mcap else [])
            wrong = judge(names, rows, known, len(second or ()), done.stdout)
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
