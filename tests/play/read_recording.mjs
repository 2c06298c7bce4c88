// What the official TypeScript reader finds in a recording, as one JSON object: tests/play/recording.rs compares it with what we say.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const installed = createRequire(new URL("../../target/readers/", import.meta.url));
const { McapIndexedReader } = installed("@mcap/core");
const lz4 = installed("@foxglove/wasm-lz4");
await lz4.isLoaded;

const file = readFileSync(process.argv[2]);
const readable = {
  size: async () => BigInt(file.length),
  read: async (offset, size) => file.subarray(Number(offset), Number(offset + size)),
};
const decompressHandlers = { lz4: (packed, size) => lz4(packed, Number(size)) };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });

const [messages, seats] = [{}, {}];
for await (const { channelId, data } of reader.readMessages()) {
  const { topic, schemaId } = reader.channelsById.get(channelId);
  messages[topic] = (messages[topic] ?? 0) + 1;
  if (reader.schemasById.get(schemaId).encoding !== "jsonschema") continue;
  const message = JSON.parse(new TextDecoder().decode(data));
  if (!topic.startsWith("/seat/")) continue;
  const sums = (seats[topic.slice("/seat/".length)] ??= { sent: 0, unsent: 0, acked: 0, refused: 0, lost: 0 });
  for (const key in sums) sums[key] += message[key];
}
const [metadata, attachments] = [{}, {}];
for await (const one of reader.readMetadata()) metadata[one.name] = Object.fromEntries(one.metadata);
for await (const one of reader.readAttachments({ validateCrcs: true })) attachments[one.name] = one.data.length;
const statistics = Number(reader.statistics.messageCount);
console.log(JSON.stringify({ messages, statistics, seats, metadata, attachments }));
