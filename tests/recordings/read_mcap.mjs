// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Reads an MCAP file of loopbit's with Foxglove's library, in the order of its index:
//
//   read_mcap.mjs NODE_MODULES FILE
//
// Fails unless every message is valid against the schema in the file and, where Foxglove has a schema of
// that name, against that one. Prints { schemas, messages: [{ topic, time_ns, message }] } as JSON.
import assert from "node:assert/strict";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [modules, file] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(modules), "index.js"));
const { McapIndexedReader } = require("@mcap/core");
const zstd = require("@foxglove/wasm-zstd");
const official = require("@foxglove/schemas/dist/jsonschema");
const { Ajv } = require("ajv");
await zstd.isLoaded;

const bytes = new Uint8Array(fs.readFileSync(file));
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
};
const decompressHandlers = { zstd: (data, size) => zstd.decompress(data, Number(size)) };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });

const ajv = new Ajv({ strict: false, allErrors: true });
const validators = new Map();
for (const [id, schema] of reader.schemasById) {
  assert.equal(schema.encoding, "jsonschema");
  const own = JSON.parse(new TextDecoder().decode(schema.data));
  assert.equal(own.title, schema.name);
  const all = [ajv.compile(own)];
  const [vendor, name] = schema.name.split(".");
  if (vendor === "foxglove") all.push(ajv.compile(official[name]));
  validators.set(id, all);
}

const messages = [];
for await (const { channelId, logTime, data } of reader.readMessages()) {
  const { topic, schemaId, messageEncoding } = reader.channelsById.get(channelId);
  assert.equal(messageEncoding, "json");
  const message = JSON.parse(new TextDecoder().decode(data));
  for (const isValid of validators.get(schemaId))
    assert.ok(isValid(message), `${topic}: ${ajv.errorsText(isValid.errors)}`);
  messages.push({ topic, time_ns: String(logTime), message });
}
assert.equal(BigInt(messages.length), reader.statistics.messageCount);
const schemas = [...reader.schemasById.values()].map(({ name }) => name);
console.log(JSON.stringify({ schemas, messages }));
