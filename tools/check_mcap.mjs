// SPDX-License-Identifier: Apache-2.0
// The other side of tools/check_mcap.sh: MCAP files by @mcap/core.
//
//   check_mcap.mjs write DIRECTORY          writes js_none.mcap, js_zstd.mcap and js_loose.mcap
//   check_mcap.mjs stream|indexed FILE      every message on a line, as check_mcap.cpp prints it
import fs from "node:fs";
import { open } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader, McapWriter } from "@mcap/core";
import lz4 from "@foxglove/wasm-lz4";
import zstd from "@foxglove/wasm-zstd";

await Promise.all([lz4.isLoaded, zstd.isLoaded]);
const decompressHandlers = {
  lz4: (bytes, size) => lz4(bytes, Number(size)),
  zstd: (bytes, size) => zstd.decompress(bytes, Number(size)),
};
const hex = (bytes) => Buffer.from(bytes).toString("hex");

async function write(path, options) {
  const parts = [];
  let size = 0;
  const writable = {
    position: () => BigInt(size),
    write: async (bytes) => {
      parts.push(Buffer.from(bytes));
      size += bytes.byteLength;
    },
  };
  const writer = new McapWriter({ writable, chunkSize: 4096, ...options });
  await writer.start({ profile: "ros2", library: "check" });
  const schemaId = await writer.registerSchema({
    name: "sensor_msgs/msg/Imu", encoding: "ros2msg", data: Buffer.from("float64 x\n") });
  const channels = [];
  for (const [topic, id] of [["/imu", schemaId], ["/note", 0]]) {
    channels.push(await writer.registerChannel({
      topic, schemaId: id, messageEncoding: "cdr", metadata: new Map([["k", "v"]]) }));
  }
  await writer.addAttachment({
    logTime: 1n, createTime: 2n, name: "a.bin", mediaType: "application/octet-stream", data: new Uint8Array(10000) });
  for (let k = 0; k < 3000; ++k) {
    await writer.addMessage({
      channelId: channels[k % 2], sequence: k, logTime: 5n + BigInt(k), publishTime: BigInt(k),
      data: new Uint8Array((k * k) % 89).fill(k % 5) });
  }
  await writer.addMetadata({ name: "m", metadata: new Map([["a", "b"]]) });
  await writer.end();
  fs.writeFileSync(path, Buffer.concat(parts));
}

const schemas = new Map();
const channels = new Map();
function take(record) {
  if (record.type === "Schema") {
    schemas.set(record.id, record);
  } else if (record.type === "Channel") {
    channels.set(record.id, record);
  } else if (record.type === "Message") {
    const channel = channels.get(record.channelId);
    const schema = schemas.get(channel.schemaId);
    const about = schema ? [schema.name, schema.encoding, hex(schema.data)] : ["-", "-", "-"];
    process.stdout.write([channel.topic, channel.messageEncoding, ...about, record.sequence, record.logTime,
      record.publishTime, hex(record.data)].join(" ") + "\n");
  }
}

const [verb, path] = process.argv.slice(2);
if (verb === "write") {
  await write(`${path}/js_none.mcap`, {});
  await write(`${path}/js_loose.mcap`, { useChunks: false });
  await write(`${path}/js_zstd.mcap`, {
    compressChunk: (bytes) => ({ compression: "zstd", compressedData: zstd.compress(bytes, 3) }) });
} else if (verb === "stream") {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(fs.readFileSync(path));
  for (let record; (record = reader.nextRecord()); ) take(record);
  if (!reader.done()) throw new Error(`${path}: the file does not end as it should`);
} else if (verb === "indexed") {
  const file = await open(path);
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, length) => {
      const bytes = new Uint8Array(Number(length));
      await file.read(bytes, 0, bytes.length, Number(offset));
      return bytes;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  for (const [id, schema] of reader.schemasById) schemas.set(id, schema);
  for (const [id, channel] of reader.channelsById) channels.set(id, channel);
  for await (const message of reader.readMessages()) take(message);
  await file.close();
} else {
  throw new Error("usage: check_mcap.mjs write DIRECTORY | stream FILE | indexed FILE");
}
