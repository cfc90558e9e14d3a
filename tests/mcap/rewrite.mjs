// Writes a bag anew with a writer that is not ours: images and camera_info of both cameras, under
// the names that another driver has, every message read and written field by field.
//     node rewrite.mjs IN.mcap OUT.mcap
import {open} from "node:fs/promises";
import {McapIndexedReader, McapWriter} from "@mcap/core";
import {FileHandleReadable, FileHandleWritable} from "@mcap/nodejs";
import {loadDecompressHandlers} from "@mcap/support";
import rosmsg from "@foxglove/rosmsg";
import {MessageReader, MessageWriter} from "@foxglove/rosmsg2-serialization";

const NAMES = {
  "/sovo/left/image_raw": "/rig/left_cam/image",
  "/sovo/right/image_raw": "/rig/right_cam/image",
  "/sovo/left/camera_info": "/rig/left_cam/camera_info",
  "/sovo/right/camera_info": "/rig/right_cam/camera_info",
};
const QOS = "- history: keep_last\n  depth: 5\n  reliability: best_effort\n  durability: volatile\n";

const [from, to] = process.argv.slice(2);
const input = await open(from, "r");
const output = await open(to, "w");
const reader = await McapIndexedReader.Initialize({
  readable: new FileHandleReadable(input), decompressHandlers: await loadDecompressHandlers()});
const writer = new McapWriter({writable: new FileHandleWritable(output), chunkSize: 500_000});
await writer.start({profile: "ros2", library: "tests"});
const channels = new Map();

async function channelOf(topic, schema) {
  const definition = rosmsg.parse(new TextDecoder().decode(schema.data), {ros2: true});
  const schemaId = await writer.registerSchema(
    {name: schema.name, encoding: "ros2msg", data: schema.data});
  const id = await writer.registerChannel({topic, schemaId, messageEncoding: "cdr",
    metadata: new Map([["offered_qos_profiles", QOS]])});
  return {id, reader: new MessageReader(definition), writer: new MessageWriter(definition),
    sequence: 0};
}

for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const topic = NAMES[channel.topic];
  if (!topic) continue;
  if (!channels.has(topic)) {
    channels.set(topic, await channelOf(topic, reader.schemasById.get(channel.schemaId)));
  }
  const there = channels.get(topic);
  const data = there.writer.writeMessage(there.reader.readMessage(message.data));
  await writer.addMessage({channelId: there.id, sequence: there.sequence++, data,
    logTime: message.logTime, publishTime: message.publishTime});
}
await writer.end();
await input.close();
await output.close();
