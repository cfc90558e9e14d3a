// Reads topics with an RTPS implementation of its own and prints one message of each as JSON.
//
// Usage: node read_topics.cjs DOMAIN SECONDS TOPIC=PACKAGE/NAME...
//
// TOPIC is a ROS name (/sovo/odom); definitions of the types are those that ROS 2 Humble has.
// Exit codes: 0 all were read, 1 some were not.
"use strict";

// The library's import of avl is not what this version of Node gives it.
const avl = require("avl");
require.cache[require.resolve("avl")].exports = avl.AVLTree ?? avl;

const { Participant } = require("@foxglove/rtps");
const rtps = require("@foxglove/rtps");
const { UdpSocketNode } = require("@foxglove/rtps/nodejs");
const { ros2humble } = require("@foxglove/rosmsg-msgs-common");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

// All types that a message of `name` is made of, its own first.
function definitionsOf(name) {
  const definitions = [];
  const add = (type) => {
    const definition = ros2humble[type];
    if (definition == undefined) throw new Error(`ROS 2 has no type ${type}`);
    if (definitions.includes(definition)) return;
    definitions.push(definition);
    for (const field of definition.definitions) if (field.isComplex) add(field.type);
  };
  add(name);
  return definitions;
}

function toJson(key, value) {
  if (typeof value === "bigint") return value.toString();
  return ArrayBuffer.isView(value) ? Array.from(value) : value;
}

async function main() {
  const [domain, seconds, ...wanted] = process.argv.slice(2);
  const waiting = new Map();
  for (const text of wanted) {
    const [topic, type] = text.split("=");
    waiting.set(`rt${topic}`, { topic, type, reader: new MessageReader(definitionsOf(type)) });
  }
  const participant = new Participant({
    name: "interop",
    addresses: ["127.0.0.1"],
    domainId: Number(domain),
    udpSocketCreate: UdpSocketNode.Create,
    log: process.env.VERBOSE ? console : undefined,
  });
  const lines = [];
  const done = new Promise((resolve) => {
    participant.on("userData", ({ publication, serializedData }) => {
      const entry = waiting.get(publication.topicName);
      if (entry == undefined) return;
      const message = entry.reader.readMessage(serializedData);
      waiting.delete(publication.topicName);
      const { durability, reliability } = publication;
      const line = { topic: entry.topic, dds_type: publication.typeName, durability, reliability };
      lines.push(JSON.stringify({ ...line, user_data: publication.userData, message }, toJson));
      if (waiting.size === 0) resolve();
    });
    setTimeout(resolve, 1000 * Number(seconds));
  });
  await participant.start();
  for (const [topicName, { type }] of waiting) {
    const [packageName, name] = type.split("/");
    participant.subscribe({
      topicName,
      typeName: `${packageName}::msg::dds_::${name}_`,
      durability: rtps.Durability.Volatile,
      reliability: { kind: rtps.Reliability.Reliable, maxBlockingTime: { sec: 0, nsec: 33000000 } },
      history: { kind: rtps.HistoryKind.KeepLast, depth: 1 },
    });
  }
  await done;
  await new Promise((resolve) => process.stdout.write(lines.join("\n") + "\n", resolve));
  for (const { topic } of waiting.values()) console.error(`nothing could be read from ${topic}`);
  process.exit(waiting.size === 0 ? 0 : 1);
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
