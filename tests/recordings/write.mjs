// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Writes recordings with Foxglove's libraries, so that loopbit's readers meet files of others:
//
//   write.mjs NODE_MODULES SPECS.json
//
// SPECS.json is a list of { out, encoding: "ros2", "ros2be" or "ros1", container: "mcap" or "messages",
// compression, chunked, messages: [{ topic, type, stamp: [s, ns], time_ns, file, ... }] }. A message of
// another type than the two of images has its fields in place of a file. "messages" is a file of messages
// alone, each after its length, for other containers.
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [modules, specsFile] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(modules), "index.js"));
const { ros1, ros2humble } = require("@foxglove/rosmsg-msgs-common");
const { MessageWriter: Ros1Writer } = require("@foxglove/rosmsg-serialization");
const { MessageWriter: Ros2Writer } = require("@foxglove/rosmsg2-serialization");
const { CdrWriter, EncapsulationKind } = require("@foxglove/cdr");
const zstd = require("@foxglove/wasm-zstd");
const lz4 = require("lz4js");
const { McapWriter } = require("@mcap/core");

const COMPRESSORS = { lz4: lz4.compress, zstd: (data) => zstd.compress(data) };

/** A schema and all that it refers to, the schema first, as both serializers want it. */
function definitions(all, name) {
  const found = [];
  const add = (each) => {
    if (found.includes(all[each])) return;
    found.push(all[each]);
    for (const field of all[each].definitions) if (field.isComplex) add(field.type);
  };
  add(name);
  return found;
}

/** The name of a type without "msg/"; images are named without their package. */
const typeOf = (message) => (message.type.includes("/") ? message.type : `sensor_msgs/${message.type}`);

function fieldsOf(message) {
  if (message.fields) return message.fields;
  const [sec, nsec] = message.stamp;
  const data = new Uint8Array(fs.readFileSync(message.file));
  const header = { seq: 7, stamp: { sec, nsec, nanosec: nsec }, frame_id: "camera" };
  if (message.type === "CompressedImage") return { header, format: message.encoding, data };
  const { height, width, encoding, step, is_bigendian } = message;
  return { header, height, width, encoding, is_bigendian, step, data };
}

/** CDR in the order of bytes that the serializer does not write. */
function bigEndian(message) {
  const { header, height, width, encoding, is_bigendian, step, data } = fieldsOf(message);
  const writer = new CdrWriter({ kind: EncapsulationKind.CDR_BE });
  writer.int32(header.stamp.sec).uint32(header.stamp.nsec).string(header.frame_id);
  writer.uint32(height).uint32(width).string(encoding).uint8(is_bigendian).uint32(step);
  writer.uint8Array(data, true);
  return writer.data;
}

function serializer(spec) {
  if (spec.encoding === "ros2be") return bigEndian;
  const writers = {};
  return (message) => {
    const name = typeOf(message);
    writers[name] ??=
      spec.encoding === "ros1"
        ? new Ros1Writer(definitions(ros1, name))
        : new Ros2Writer(definitions(ros2humble, name));
    return writers[name].writeMessage(fieldsOf(message));
  };
}

class Output {
  #file;
  #size = 0n;
  constructor(name) {
    this.#file = fs.openSync(name, "w");
  }
  async write(bytes) {
    fs.writeSync(this.#file, bytes);
    this.#size += BigInt(bytes.byteLength);
  }
  position() {
    return this.#size;
  }
  close() {
    fs.closeSync(this.#file);
  }
}

async function writeMcap(spec, serialize) {
  const output = new Output(spec.out);
  const compress = COMPRESSORS[spec.compression];
  const writer = new McapWriter({
    writable: output,
    useChunks: spec.chunked,
    chunkSize: spec.chunk_size,
    compressChunk: compress
      ? (data) => ({ compression: spec.compression, compressedData: compress(data) })
      : undefined,
  });
  await writer.start({ profile: spec.encoding === "ros1" ? "ros1" : "ros2", library: "a test" });
  const channels = {};
  for (const [sequence, message] of spec.messages.entries()) {
    const { topic } = message;
    if (!(topic in channels)) {
      const name = typeOf(message);
      const schemaId = await writer.registerSchema({
        name: spec.encoding === "ros1" ? name : name.replace("/", "/msg/"),
        encoding: spec.encoding === "ros1" ? "ros1msg" : "ros2msg",
        data: new Uint8Array(),
      });
      const messageEncoding = spec.encoding === "ros1" ? "ros1" : "cdr";
      channels[topic] = await writer.registerChannel({ topic, schemaId, messageEncoding, metadata: new Map() });
    }
    const time = BigInt(message.time_ns);
    const data = serialize(message);
    await writer.addMessage({ channelId: channels[topic], sequence, logTime: time, publishTime: time, data });
  }
  await writer.end();
  output.close();
}

async function writeMessages(spec, serialize) {
  const output = new Output(spec.out);
  for (const message of spec.messages) {
    const data = serialize(message);
    const length = new DataView(new ArrayBuffer(4));
    length.setUint32(0, data.byteLength, true);
    await output.write(new Uint8Array(length.buffer));
    await output.write(data);
  }
  output.close();
}

await zstd.isLoaded;
for (const spec of JSON.parse(fs.readFileSync(specsFile, "utf8"))) {
  await (spec.container === "mcap" ? writeMcap : writeMessages)(spec, serializer(spec));
}
