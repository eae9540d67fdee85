// Reads a log with MCAP's own readers, the streaming and the indexed one: every message, schema, channel and the summary.
//   node read.mjs NODE_MODULES FILE       prints one JSON object
import { createRequire } from "node:module";
import { open, readFile } from "node:fs/promises";
import { resolve } from "node:path";

const [modules, file] = process.argv.slice(2);
const require = createRequire(resolve(modules, "package.json"));
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { decompress } = require("fzstd");
const decompressHandlers = { zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size))) };
const fail = (text) => { throw new Error(text); };

const stream = new McapStreamReader({ decompressHandlers, includeChunks: false, validateCrcs: true });
stream.append(new Uint8Array(await readFile(file)));
const schemas = new Map();
const channels = new Map();
const streamed = {};
let messages = 0;
let ended = false;
for (let record; (record = stream.nextRecord()) !== undefined; ) {
  if (record.type === "Schema") schemas.set(record.id, record);
  if (record.type === "Channel") channels.set(record.id, record);
  if (record.type === "Footer") ended = true;
  if (record.type !== "Message") continue;
  const channel = channels.get(record.channelId) ?? fail(`message of channel ${record.channelId} before it`);
  streamed[channel.topic] = (streamed[channel.topic] ?? 0) + 1;
  ++messages;
  if (channel.messageEncoding !== "json") continue;
  const schema = schemas.get(channel.schemaId) ?? fail(`no schema of ${channel.topic}`);
  const value = JSON.parse(new TextDecoder().decode(record.data));
  const properties = JSON.parse(new TextDecoder().decode(schema.data)).properties;
  if (Object.keys(properties).length === 0) continue;
  for (const key of Object.keys(value)) properties[key] ?? fail(`${channel.topic}: ${key} is not in ${schema.name}`);
}
if (!ended) fail("no footer");

const handle = await open(file);
const readable = {
  size: async () => BigInt((await handle.stat()).size),
  read: async (offset, size) => {
    const bytes = new Uint8Array(Number(size));
    await handle.read(bytes, 0, bytes.length, Number(offset));
    return bytes;
  },
};
const indexed = await McapIndexedReader.Initialize({ readable, decompressHandlers });
let found = 0;
let before = 0n;
for await (const message of indexed.readMessages()) {
  if (message.logTime < before) fail("the indexed reader's messages are out of order");
  before = message.logTime;
  ++found;
}
const metadata = [];
for await (const one of indexed.readMetadata()) metadata.push(one.name);
const statistics = indexed.statistics ?? fail("no statistics");
if (found !== messages || Number(statistics.messageCount) !== messages)
  fail(`${messages} messages streamed, ${found} by index, ${statistics.messageCount} in the statistics`);
if (indexed.schemasById.size !== schemas.size || indexed.channelsById.size !== channels.size)
  fail("the summary holds other schemas or channels");
await handle.close();
console.log(JSON.stringify({
  messages,
  topics: streamed,
  schemas: [...schemas.values()].map((schema) => schema.name),
  chunks: indexed.chunkIndexes.length,
  summary_offsets: indexed.summaryOffsetsByOpcode.size,
  metadata,
  seconds: Number(before) / 1e9,
}));
