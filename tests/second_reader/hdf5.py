# SPDX-License-Identifier: Apache-2.0
"""HDF5 by hand, without its library: enough for what `convert` writes and for the plainest file of doubles.

From the "HDF5 File Format Specification", version 3.0: superblock of version 0 (II.A), groups of version 1 (III.A to
D), object headers of version 1 (IV.A.1.a), dataspaces, doubles, attributes, layouts of version 3, chunks that are
shuffled and deflated.
"""

import struct
import zlib

NONE = 0xFFFFFFFFFFFFFFFF
SIGNATURE = b"\x89HDF\r\n\x1a\n"
# IEEE 754, 64 bits, little-endian (IV.A.2.d): class 1 of version 1, what its bits are, 8 bytes.
DOUBLE = bytes([0x11, 0x20, 0x3F, 0x00]) + struct.pack("<IHHBBBBI", 8, 0, 64, 52, 11, 0, 52, 1023)
LAYOUT, TYPE, SPACE, FILTERS, ATTRIBUTE, CONTINUED, SYMBOLS = 0x08, 0x03, 0x01, 0x0B, 0x0C, 0x10, 0x11
UNITS = {"t": b"s", "phi_r": b"rad", "phi_l": b"rad", "omega_r": b"rad/s", "omega_l": b"rad/s", "tau_r": b"N\xc2\xb7m",
         "tau_l": b"N\xc2\xb7m"}


class Unreadable(Exception):
    pass


class File:
    def __init__(self, data):
        self.data = data
        if (data[:8] != SIGNATURE or self.at("<B", 8)[0] != 0 or self.at("<BB", 13) != (8, 8)
                or self.at("<Q", 24) != (0,)):
            raise Unreadable

    def at(self, form, place):
        if place + struct.calcsize(form) > len(self.data):
            raise Unreadable
        return struct.unpack_from(form, self.data, place)

    def messages(self, header):
        """(type, data) of an object."""
        version, count, size = self.at("<BxHxxxxI", header)
        if version != 1:
            raise Unreadable
        blocks, found = [(header + 16, size)], []
        while blocks and len(found) < count:
            place, left = blocks.pop(0)
            while left >= 8 and len(found) < count:
                kind, size, flags = self.at("<HHB", place)
                if size + 8 > left or place + 8 + size > len(self.data) or flags & 2:
                    raise Unreadable
                data = self.data[place + 8:place + 8 + size]
                found.append((kind, data))
                if kind == CONTINUED:
                    blocks.append(struct.unpack_from("<QQ", data))
                place, left = place + 8 + size, left - 8 - size
        return found

    def leaves(self, node, kind, key_size, seen):
        """(key, address) of a B-tree's children."""
        signature, its_kind, level, count = self.at("<4sBBH", node)
        if signature != b"TREE" or its_kind != kind or node in seen:
            raise Unreadable
        seen.add(node)
        for k in range(count):
            place = node + 24 + k * (key_size + 8)
            child, = self.at("<Q", place + key_size)
            if level:
                yield from self.leaves(child, kind, key_size, seen)
            else:
                yield self.data[place:place + key_size], child

    def group(self, header):
        """name: address of a group's members."""
        table = [data for kind, data in self.messages(header) if kind == SYMBOLS]
        if len(table) != 1:
            raise Unreadable
        tree, heap = struct.unpack_from("<QQ", table[0])
        signature, size, names = self.at("<4s4xQ8xQ", heap)
        if signature != b"HEAP" or names + size > len(self.data):
            raise Unreadable
        members = {}
        for _, node in self.leaves(tree, 0, 8, set()):
            signature, count = self.at("<4sxxH", node)
            if signature != b"SNOD":
                raise Unreadable
            for k in range(count):
                name, address, cached = self.at("<QQI", node + 8 + 40 * k)
                if name >= size or cached == 2:
                    raise Unreadable
                members[self.data[names + name:self.data.index(b"\0", names + name)]] = address
        return members

    def attribute(self, data):
        """(name, text)"""
        version, name, kind, space = struct.unpack_from("<BxHHH", data)
        if version != 1:
            raise Unreadable
        places, at = [], 8
        for size in (name, kind, space):
            places.append(data[at:at + size])
            at += (size + 7) // 8 * 8
        if places[1][0] != 0x13:  # a string of fixed length
            raise Unreadable
        return places[0].split(b"\0")[0], data[at:at + struct.unpack_from("<I", places[1], 4)[0]].split(b"\0")[0]

    def doubles(self, name, header):
        found, units = {}, None
        for kind, data in self.messages(header):
            if kind == ATTRIBUTE:
                title, text = self.attribute(data)
                units = text if title in (b"units", b"unit") else units
            elif kind in found:
                raise Unreadable
            else:
                found[kind] = data
        if units not in (None, UNITS.get(name)) or LAYOUT not in found or SPACE not in found:
            raise Unreadable
        version, rank = found[SPACE][:2]
        if (version, rank) != (1, 1) or found.get(TYPE, b"")[:20] != DOUBLE[:20]:
            raise Unreadable
        rows, = struct.unpack_from("<Q", found[SPACE], 8)
        if rows > 10**6:
            raise Unreadable
        version, kind = found[LAYOUT][:2]
        if version != 3 or kind not in (1, 2):
            raise Unreadable
        if kind == 1:
            place, size = struct.unpack_from("<QQ", found[LAYOUT], 2)
            if size < 8 * rows:
                raise Unreadable
            return list(self.at(f"<{rows}d", place))
        return self.chunks(found, rows)

    def chunks(self, found, rows):
        dimensions, tree, length, width = struct.unpack_from("<BQII", found[LAYOUT], 2)
        if (dimensions, width) != (2, 8) or not 0 < length <= 10**6:
            raise Unreadable
        filters = pipeline(found.get(FILTERS))
        values = [None] * rows
        for key, place in self.leaves(tree, 1, 24, set()):
            size, mask, first = struct.unpack_from("<IIQ", key)
            if mask or place + size > len(self.data) or first % length or first >= rows:
                raise Unreadable
            data = self.data[place:place + size]
            try:
                data = zlib.decompress(data) if 1 in filters else data
            except zlib.error as wrong:
                raise Unreadable from wrong
            if len(data) != 8 * length:
                raise Unreadable
            if 2 in filters:
                data = bytes(data[k // 8 + k % 8 * length] for k in range(8 * length))
            for k, value in enumerate(struct.unpack(f"<{length}d", data)):
                if first + k < rows:
                    values[first + k] = value
        if None in values:
            raise Unreadable
        return values


def pipeline(message):
    """Of the filters that `convert` uses: none, or shuffle and then deflate."""
    if message is None:
        return ()
    version, count = message[:2]
    if version != 1:
        raise Unreadable
    at, filters = 8, []
    for _ in range(count):
        number, name, flags, values = struct.unpack_from("<HHHH", message, at)
        at += 8 + (name + 7) // 8 * 8 + 4 * (values + values % 2)
        filters.append(number)
    if filters != [2, 1]:
        raise Unreadable
    return filters


def read(path, group=b""):
    """Columns of doubles with the names of the log contract."""
    try:
        file = File(path.read_bytes())
        members = file.group(file.at("<Q", 64)[0])
        if group:
            members = file.group(members[group])
        names = {name.decode(): address for name, address in members.items()}
        columns = {name: file.doubles(name, address) for name, address in names.items() if name in UNITS}
    except (struct.error, KeyError, IndexError, ValueError, RecursionError) as wrong:
        raise Unreadable from wrong
    if "t" not in columns or len({len(column) for column in columns.values()}) != 1:
        raise Unreadable
    return columns


def write(path, columns, piece=0):
    """Datasets of doubles in the root group, in one piece each or in pieces of so many, without filters and
    attributes."""
    data = bytearray(96)  # the superblock, written last

    def put(content):
        data.extend(content + b"\0" * (-len(content) % 8))
        return len(data) - len(content) - (-len(content) % 8)

    def header(*messages):
        body = b""
        for kind, content in messages:
            content += b"\0" * (-len(content) % 8)
            body += struct.pack("<HHBxxx", kind, len(content), 0) + content
        return put(struct.pack("<BxHII4x", 1, len(messages), 1, len(body)) + body)

    names = sorted(columns)
    addresses, offsets, text = [], [], b"\0" * 8
    for name in names:
        values = columns[name]
        if piece:
            keys = b""
            for first in range(0, len(values), piece):
                part = (values[first:first + piece] + [0.0] * piece)[:piece]
                keys += struct.pack("<IIQQQ", 8 * piece, 0, first, 0, put(struct.pack(f"<{piece}d", *part)))
            count = -(-len(values) // piece)
            keys += struct.pack("<IIQQ", 0, 0, count * piece, 8)
            head = struct.pack("<4sBBHQQ", b"TREE", 1, 0, count, NONE, NONE)
            tree = put((head + keys).ljust(24 + 32 * 64 + 24, b"\0"))
            layout = struct.pack("<BBBQII", 3, 2, 2, tree, piece, 8)
        else:
            layout = struct.pack("<BBQQ", 3, 1, put(struct.pack(f"<{len(values)}d", *values)), 8 * len(values))
        space = struct.pack("<BBBxxxxxQ", 1, 1, 0, len(values))
        addresses.append(header((SPACE, space), (TYPE, DOUBLE), (LAYOUT, layout)))
        offsets.append(len(text))
        text += name.encode() + b"\0" * (8 - len(name) % 8)
    symbols = b"".join(struct.pack("<QQIxxxx16x", offset, address, 0) for offset, address in zip(offsets, addresses))
    node = put((struct.pack("<4sBxH", b"SNOD", 1, len(names)) + symbols).ljust(8 + 40 * 8, b"\0"))  # 2 × leaf K of 4
    heap = put(struct.pack("<4sBxxxQQQ", b"HEAP", 0, len(text), 1, len(data) + 32) + text)
    keys = struct.pack("<QQQ", 0, node, offsets[-1])
    head = struct.pack("<4sBBHQQ", b"TREE", 0, 0, 1, NONE, NONE)
    tree = put((head + keys).ljust(24 + 8 * 65, b"\0"))  # internal K of 16
    root = header((SYMBOLS, struct.pack("<QQ", tree, heap)))
    data[:96] = (SIGNATURE + bytes([0, 0, 0, 0, 0, 8, 8, 0]) + struct.pack("<HHI", 4, 16, 0)
                 + struct.pack("<QQQQ", 0, NONE, len(data), NONE) + struct.pack("<QQIxxxxQQ", 0, root, 1, tree, heap))
    path.write_bytes(data)
