// Reads a recording with readers that are not ours: every record by the index and by streaming,
// every checksum, every field of every message. Prints the number of messages by topic as JSON.
import {open} from "node:fs/promises";
import {McapIndexedReader, McapStreamReader} from "@mcap/core";
import {FileHandleReadable} from "@mcap/nodejs";
import {loadDecompressHandlers} from "@mcap/support";
import rosmsg from "@foxglove/rosmsg";
import {MessageReader} from "@foxglove/rosmsg2-serialization";

/** Number of leaves of a value; reading them proves that they are there. */
function countFields(value) {
  if (ArrayBuffer.isView(value)) return value.length;
  if (Array.isArray(value)) return value.reduce((sum, v) => sum + countFields(v), 0);
  if (value !== null && typeof value === "object") {
    return Object.values(value).reduce((sum, v) => sum + countFields(v), 0);
  }
  if (value === undefined) throw new Error("a field is missing");
  return 1;
}

class Decoder {
  readers = new Map();
  read(schema, data) {
    if (schema.encoding !== "ros2msg") throw new Error(`schema encoding ${schema.encoding}`);
    if (!this.readers.has(schema.name)) {
      const text = new TextDecoder().decode(schema.data);
      this.readers.set(schema.name, new MessageReader(rosmsg.parse(text, {ros2: true})));
    }
    return this.readers.get(schema.name).readMessage(data);
  }
}

async function readIndexed(file, decompressHandlers) {
  const reader = await McapIndexedReader.Initialize({
    readable: new FileHandleReadable(file), decompressHandlers});
  if (reader.header.profile !== "ros2") throw new Error(`profile ${reader.header.profile}`);
  const decoder = new Decoder();
  const topics = {};
  for await (const message of reader.readMessages({validateCrcs: true})) {
    const channel = reader.channelsById.get(message.channelId);
    if (channel.messageEncoding !== "cdr") throw new Error(`encoding ${channel.messageEncoding}`);
    if (!channel.metadata.get("offered_qos_profiles")) throw new Error("no QoS");
    const value = decoder.read(reader.schemasById.get(channel.schemaId), message.data);
    const topic = topics[channel.topic] ??= {messages: 0, fields: 0};
    topic.messages += 1;
    topic.fields += countFields(value);
  }
  const attachments = [];
  for await (const attachment of reader.readAttachments()) attachments.push(attachment.name);
  const total = Object.values(topics).reduce((sum, t) => sum + t.messages, 0);
  if (BigInt(total) !== reader.statistics.messageCount) throw new Error("statistics are wrong");
  return {topics, attachments};
}

async function readStream(file, decompressHandlers) {
  const reader = new McapStreamReader({decompressHandlers, validateCrcs: true});
  const buffer = new Uint8Array(1 << 20);
  let messages = 0;
  for (let position = 0; ;) {
    const {bytesRead} = await file.read(buffer, 0, buffer.length, position);
    if (bytesRead === 0) break;
    position += bytesRead;
    reader.append(buffer.slice(0, bytesRead));
    for (let record; (record = reader.nextRecord());) if (record.type === "Message") messages += 1;
  }
  if (!reader.done()) throw new Error("the stream does not end");
  return messages;
}

const handlers = await loadDecompressHandlers();
const file = await open(process.argv[2], "r");
const {topics, attachments} = await readIndexed(file, handlers);
const streamed = await readStream(file, handlers);
await file.close();
console.log(JSON.stringify({topics, attachments, streamed}));
