// SPDX-License-Identifier: Apache-2.0
// The other side of tools/check_bag.sh: messages of ROS 2 by Foxglove's packages.
//
//   check_bag.mjs write TYPES FILE    writes messages made at random of the types in TYPES (JSON: name, definition), and
//                                     prints every number in them on a line, as check_bag.cpp does
//   check_bag.mjs read FILE           prints those of a file
import fs from "node:fs";
import { McapStreamReader, McapWriter } from "@mcap/core";
import zstd from "@foxglove/wasm-zstd";
import { parse } from "@foxglove/rosmsg";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";

await zstd.isLoaded;

// A generator of its own, so that every run makes the same messages.
let state = 12345n;
function random(below) {
  state = (state * 6364136223846793005n + 1442695040888963407n) & 0xffffffffffffffffn;
  return Number((state >> 33n) % BigInt(below));
}

const bits = { int8: 8, uint8: 8, int16: 16, uint16: 16, int32: 32, uint32: 32, int64: 64, uint64: 64 };
function primitive(type) {
  if (type === "bool") return random(2) === 1;
  if (type === "string") return "x".repeat(random(6));
  if (type === "float32") return Math.fround(random(100000) / 7);
  if (type === "float64") return random(1000000) / 3 - 50000;
  if (type === "time" || type === "duration") {
    const nanoseconds = random(1000000000);
    return { sec: random(2000000000), nsec: nanoseconds, nanosec: nanoseconds };
  }
  const unsigned = type.startsWith("u");
  const value = BigInt(random(2000000000)) % (1n << BigInt(bits[type] - 1));
  const signed = unsigned || random(2) ? value : -value;
  return bits[type] === 64 ? signed : Number(signed);
}
function make(name, types) {
  const message = {};
  for (const field of types.get(name).definitions) {
    if (field.isConstant) continue;
    const one = () => (field.isComplex ? make(field.type, types) : primitive(field.type));
    message[field.name] = field.isArray ? Array.from({ length: field.arrayLength ?? random(4) }, one) : one();
  }
  return message;
}

const buffer = new DataView(new ArrayBuffer(8));
function number(topic, path, value) {
  buffer.setFloat64(0, Number(value));
  process.stdout.write(`${topic} ${path} ${buffer.getBigUint64(0).toString(16).padStart(16, "0")}\n`);
}
function print(topic, path, value, name, types) {
  for (const field of types.get(name).definitions) {
    if (field.isConstant || field.type === "string") continue;
    const items = field.isArray ? Array.from(value[field.name]).slice(0, 3) : [value[field.name]];
    items.forEach((item, index) => {
      const here = `${path}${field.name}${field.isArray ? `[${index}]` : ""}`;
      if (field.isComplex) {
        print(topic, `${here}.`, item, field.type, types);
      } else if (field.type === "time" || field.type === "duration") {
        number(topic, `${here}.sec`, item.sec);
        number(topic, `${here}.nanosec`, item.nsec ?? item.nanosec);
      } else {
        number(topic, here, item);
      }
    });
  }
}

function definitions(text) {
  const all = parse(text, { ros2: true });
  const types = new Map(all.map((type) => [type.name, type]));
  types.set("", all.find((type) => type.name == undefined) ?? all[0]);
  return [all, types];
}

const [verb, first, second] = process.argv.slice(2);
if (verb === "write") {
  const parts = [];
  let size = 0;
  const writable = {
    position: () => BigInt(size),
    write: async (bytes) => {
      parts.push(Buffer.from(bytes));
      size += bytes.byteLength;
    },
  };
  const writer = new McapWriter({ writable });
  await writer.start({ profile: "ros2", library: "check" });
  for (const [key, text] of Object.entries(JSON.parse(fs.readFileSync(first)))) {
    const name = key.split(" ")[0];
    const [all, types] = definitions(text);
    const schemaId = await writer.registerSchema({ name, encoding: "ros2msg", data: Buffer.from(text) });
    for (let k = 0; k < 20; ++k) {
      const topic = `/${key.replaceAll(/[^a-zA-Z0-9]/g, "_")}_${k}`;
      const channelId = await writer.registerChannel({
        topic, schemaId, messageEncoding: "cdr", metadata: new Map() });
      const message = make("", types);
      const data = new MessageWriter(all).writeMessage(message);
      await writer.addMessage({ channelId, sequence: 0, logTime: BigInt(k), publishTime: 0n, data });
      print(topic, "", message, "", types);
    }
  }
  await writer.end();
  fs.writeFileSync(second, Buffer.concat(parts));
} else if (verb === "read") {
  const reader = new McapStreamReader({
    decompressHandlers: { zstd: (bytes, length) => zstd.decompress(bytes, Number(length)) }, validateCrcs: true });
  reader.append(fs.readFileSync(first));
  const schemas = new Map(), channels = new Map();
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Message") {
      const channel = channels.get(record.channelId);
      const [all, types] = definitions(Buffer.from(schemas.get(channel.schemaId).data).toString());
      print(channel.topic, "", new MessageReader(all).readMessage(record.data), "", types);
    }
  }
} else {
  throw new Error("usage: check_bag.mjs write TYPES FILE | read FILE");
}
