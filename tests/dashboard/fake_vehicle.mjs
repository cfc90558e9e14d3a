// A vehicle without a vehicle: Foxglove's protocol with made-up messages, as fast as wanted, for
// tests of the page alone.
import { createRequire } from "node:module";
import fs from "node:fs";
import http from "node:http";
import path from "node:path";

const root = path.resolve(path.dirname(new URL(import.meta.url).pathname), "../..");
const require = createRequire(path.join(root, "dashboard/package.json"));
const { WebSocketServer } = require("ws");
const { parse } = require("@foxglove/rosmsg");
const { MessageWriter } = require("@foxglove/rosmsg2-serialization");

/** Text of a message type with all types in it, from the .msg files of the project. */
export function schemaOf(name) {
  const [pkg, , type] = name.split("/");
  const file = (p, t) =>
    p === "sovo_msgs"
      ? path.join(root, "ros2/sovo_msgs/msg", `${t}.msg`)
      : path.join(root, "idl", p, "msg", `${t}.msg`);
  const seen = new Set();
  const parts = [];
  const visit = (p, t) => {
    if (seen.has(`${p}/${t}`)) return;
    seen.add(`${p}/${t}`);
    const text = fs.readFileSync(file(p, t), "utf8");
    parts.push(parts.length === 0 ? text : `MSG: ${p}/${t}\n${text}`);
    for (const line of text.split("\n")) {
      const field = /^([A-Za-z_0-9/]+)(\[.*\])?\s+[a-z_0-9]+\s*(#.*)?$/.exec(line.trim());
      if (!field || /^(u?int(8|16|32|64)|float(32|64)|bool|byte|char|string)$/.test(field[1])) continue;
      const [a, b] = field[1].includes("/") ? field[1].split("/") : [p, field[1]];
      visit(a, b);
    }
  };
  visit(pkg, type);
  return parts.join(`\n${"=".repeat(80)}\n`);
}

const kTypes = {
  status: "sovo_msgs/msg/VoStatus",
  scaled_odometry: "sovo_msgs/msg/ScaledOdometry",
  keyframe: "sovo_msgs/msg/Keyframe",
  points: "sensor_msgs/msg/PointCloud2",
  calibration: "sovo_msgs/msg/StereoCalibration",
  "left/preview/compressed": "sensor_msgs/msg/CompressedImage",
  "right/preview_small/compressed": "sensor_msgs/msg/CompressedImage",
  tracked_points: "sovo_msgs/msg/TrackedPoints",
  odom: "nav_msgs/msg/Odometry",
  map_path: "nav_msgs/msg/Path",
};
const kMime = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml" };

/** Serves `page` and the vehicles; `send(name, message, seconds, ns)` publishes. */
export async function startFakeVehicle(page, vehicles = ["/sovo"], port = 0) {
  const server = http.createServer((request, response) => {
    const name = request.url.split("?")[0];
    const file = path.join(page, name === "/" ? "index.html" : path.normalize(name));
    if (!fs.existsSync(file)) return void response.writeHead(404).end();
    response.writeHead(200, { "Content-Type": kMime[path.extname(file)] ?? "application/octet-stream" });
    response.end(fs.readFileSync(file));
  });
  const sockets = new WebSocketServer({ server, handleProtocols: (offered) => [...offered][0] });
  const names = Object.keys(kTypes);
  const writers = names.map((n) => new MessageWriter(parse(schemaOf(kTypes[n]), { ros2: true })));
  const channels = vehicles.flatMap((ns, v) =>
    names.map((n, i) => ({
      id: v * names.length + i + 1,
      topic: `${ns}/${n}`,
      encoding: "cdr",
      schemaName: kTypes[n],
      schema: schemaOf(kTypes[n]),
      schemaEncoding: "ros2msg",
    })),
  );
  const shown = channels.filter((c) => /^\/[^/]+\/(?!odom$|map_path$)/.test(c.topic));
  const clients = new Map();
  sockets.on("connection", (socket) => {
    const subscriptions = new Map();
    clients.set(socket, subscriptions);
    socket.on("close", () => clients.delete(socket));
    socket.on("message", (data) => {
      const message = JSON.parse(String(data));
      if (message.op === "subscribe") {
        for (const s of message.subscriptions) subscriptions.set(s.channelId, s.id);
      } else if (message.op === "unsubscribe") {
        for (const [channel, id] of subscriptions) {
          if (message.subscriptionIds.includes(id)) subscriptions.delete(channel);
        }
      }
    });
    socket.send(JSON.stringify({ op: "serverInfo", name: "fake", capabilities: [], sessionId: "1" }));
    socket.send(JSON.stringify({ op: "advertise", channels }));
  });
  await new Promise((resolve) => server.listen(port, "127.0.0.1", resolve));
  return {
    url: `http://127.0.0.1:${server.address().port}/`,
    /** Whether somebody listens to all that the page shows of a vehicle. */
    subscribed(ns = "/sovo") {
      const wanted = shown.filter((c) => c.topic.startsWith(`${ns}/`));
      return [...clients.values()].some((s) => wanted.every((c) => s.has(c.id)));
    },
    isHeard(topic) {
      const { id } = channels.find((c) => c.topic === topic);
      return [...clients.values()].some((s) => s.has(id));
    },
    get backlog() {
      return Math.max(0, ...[...clients.keys()].map((s) => s.bufferedAmount));
    },
    send(name, message, seconds, ns = "/sovo") {
      const index = names.indexOf(name);
      const channel = channels.find((c) => c.topic === `${ns}/${name}`);
      const payload = writers[index].writeMessage(message);
      for (const [socket, subscriptions] of clients) {
        const id = subscriptions.get(channel.id);
        if (id === undefined) continue;
        const frame = Buffer.alloc(13 + payload.length);
        frame[0] = 1;
        frame.writeUInt32LE(id, 1);
        frame.writeBigUInt64LE(BigInt(Math.round(seconds * 1e9)), 5);
        frame.set(payload, 13);
        socket.send(frame);
      }
    },
    close() {
      for (const socket of clients.keys()) socket.terminate();
      server.close();
    },
  };
}

const stampOf = (t) => ({ sec: Math.floor(t), nanosec: Math.floor((t % 1) * 1e9) });
const zero = { x: 0, y: 0, z: 0 };

/** The messages of one frame of a mowing pattern at time t since the start [s]. */
export function frameAt(t, start = 1_700_000_000) {
  const stamp = stampOf(start + t);
  const x = 6 * Math.sin(t / 5) + 0.02 * t;
  const y = 5 * Math.cos(t / 9);
  const z = 0.5 * Math.sin(t / 7);
  const yaw = Math.atan2(-(5 / 9) * Math.sin(t / 9), (6 / 5) * Math.cos(t / 5) + 0.02);
  const pose = {
    position: { x, y, z },
    orientation: { x: 0, y: 0, z: Math.sin(yaw / 2), w: Math.cos(yaw / 2) },
  };
  const lostNow = t % 60 > 41 && t % 60 < 44;
  const unobserved = t % 60 > 20 && t % 60 < 27;
  const state = lostNow ? 4 : unobserved ? 2 : 1;
  const header = { stamp, frame_id: "odom" };
  const status = {
    header,
    state,
    reason: lostNow ? "too few pixels agree" : unobserved ? "no near texture for 4 s" : "",
    session: 1n,
    sequence: BigInt(Math.round(t * 20)),
    received: BigInt(Math.round(t * 20)),
    lost_transport: BigInt(Math.floor(t / 17)),
    points: 2000,
    inliers: 1500 + Math.round(300 * Math.sin(t)),
    keyframes: 7,
    sync_error_s: 0.0002 + 0.0001 * Math.sin(t),
    residual: 4 + Math.sin(t / 2),
    latency_s: 0.04 + 0.01 * Math.abs(Math.sin(3 * t)),
    distance_m: t,
    stages: [
      { name: "tracking", last_ms: 8 + 2 * Math.sin(t), mean_ms: 8, max_ms: 20 },
      { name: "bundle_adjustment", last_ms: 22 + 5 * Math.sin(t / 3), mean_ms: 22, max_ms: 40 },
      { name: "scale_optimization", last_ms: 3, mean_ms: 3, max_ms: 6 },
    ],
  };
  const scaled = {
    header,
    child_frame_id: "base_link",
    pose: { pose, covariance: new Array(36).fill(0) },
    twist: {
      twist: { linear: { x: 1 + 0.2 * Math.sin(t), y: 0, z: 0 }, angular: zero },
      covariance: new Array(36).fill(0),
    },
    state,
    segment: Math.floor(t / 60),
    scale_valid: true,
    log_scale: 0.01 * Math.sin(t / 8),
    log_scale_sigma: 0.004 + (unobserved ? 0.01 : 0),
    scale_residual: 6 + 2 * Math.sin(t / 3),
    scale_verdict: unobserved ? 2 : 0,
  };
  return { status, scaled: lostNow ? undefined : scaled, pose, stamp };
}

/** A keyframe with no points, at a pose. */
export function keyframeAt(id, pose, stamp) {
  return { header: { stamp, frame_id: "odom" }, id, segment: 0, pose, log_scale: 0 };
}

/** `count` points of a floor around a place. */
export function cloudAt(pose, stamp, count = 2000) {
  const data = new Uint8Array(16 * count);
  const view = new DataView(data.buffer);
  for (let i = 0; i < count; ++i) {
    const [a, b] = [Math.random(), Math.random()];
    view.setFloat32(16 * i, pose.position.x + 5 * (a - 0.5), true);
    view.setFloat32(16 * i + 4, pose.position.y + 5 * (b - 0.5), true);
    view.setFloat32(16 * i + 8, -2 + 0.2 * Math.sin(3 * pose.position.x + 9 * a), true);
    view.setFloat32(16 * i + 12, 255 * Math.random(), true);
  }
  const fields = ["x", "y", "z", "intensity"].map((name, i) => ({
    name,
    offset: 4 * i,
    datatype: 7,
    count: 1,
  }));
  return {
    header: { stamp, frame_id: "odom" },
    height: 1,
    width: count,
    fields,
    is_bigendian: false,
    point_step: 16,
    row_step: 16 * count,
    data,
    is_dense: true,
  };
}
