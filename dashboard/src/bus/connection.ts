import { parse } from "@foxglove/rosmsg";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";

/** A topic that the server offers. */
export interface Channel {
  id: number;
  topic: string;
  encoding: string;
  schemaName: string;
  schema: string;
}

export type LinkState = "connecting" | "open" | "lost";
type Handler<T> = (message: T, stampNs: bigint) => void;

interface Wish {
  topic: string;
  handler: Handler<never>;
  subscription: number | undefined;
  channel: number | undefined;
}

const kFirstRetryMs = 250;
const kLongestRetryMs = 4000;
// A socket that says nothing is tried again: a cut cable closes nothing.
const kSilenceMs = 8000;

/**
 * Foxglove's WebSocket protocol from the client's side. What is wished for stays wished for: topics
 * are subscribed when they appear and again after every reconnection.
 */
export class Connection {
  state: LinkState = "connecting";
  canCommand = false;
  attempts = 0;
  received = 0;
  receivedBytes = 0;
  readonly channels = new Map<number, Channel>();

  onState: () => void = () => {};
  onChannels: () => void = () => {};
  onNotice: (level: number, message: string) => void = () => {};

  private socket: WebSocket | undefined;
  private readonly readers = new Map<string, MessageReader>();
  private readonly wishes = new Set<Wish>();
  private readonly bySubscription = new Map<number, Wish>();
  private readonly published = new Map<string, { id: number; writer: MessageWriter }>();
  private nextSubscription = 1;
  private retryMs = kFirstRetryMs;
  private heard = 0;

  constructor(private readonly url: string) {
    this.connect();
    window.setInterval(() => this.watch(), 1000);
  }

  /** Hands over messages of `topic` from now on, whenever it exists. Returns how to end that. */
  want<T>(topic: string, handler: Handler<T>): () => void {
    const wish: Wish = {
      topic,
      handler: handler as Handler<never>,
      subscription: undefined,
      channel: undefined,
    };
    this.wishes.add(wish);
    this.subscribe();
    return () => {
      this.wishes.delete(wish);
      if (wish.subscription === undefined) return;
      this.bySubscription.delete(wish.subscription);
      this.say({ op: "unsubscribe", subscriptionIds: [wish.subscription] });
    };
  }

  has(topic: string): boolean {
    return this.find(topic) !== undefined;
  }

  /** Gets ready to publish; the server complains when it may not be. */
  advertise(topic: string, schemaName: string, schema: string): void {
    if (this.published.has(topic)) return;
    const id = this.published.size + 1;
    this.published.set(topic, { id, writer: new MessageWriter(parse(schema, { ros2: true })) });
    this.say({ op: "advertise", channels: [{ id, topic, encoding: "cdr", schemaName }] });
  }

  publish(topic: string, message: unknown): boolean {
    const channel = this.published.get(topic);
    if (!channel || this.socket?.readyState !== WebSocket.OPEN) return false;
    const payload = channel.writer.writeMessage(message);
    const frame = new Uint8Array(5 + payload.length);
    frame[0] = 1;
    new DataView(frame.buffer).setUint32(1, channel.id, true);
    frame.set(payload, 5);
    this.socket.send(frame);
    return true;
  }

  private connect(): void {
    this.attempts += 1;
    const socket = new WebSocket(this.url, ["foxglove.sdk.v1", "foxglove.websocket.v1"]);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.heard = performance.now();
    socket.onopen = () => {
      this.retryMs = kFirstRetryMs;
      this.attempts = 0;
      this.setState("open");
    };
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      this.heard = performance.now();
      if (typeof event.data === "string") this.hear(event.data);
      else this.receive(event.data);
    };
    socket.onclose = () => this.lose(socket);
  }

  private lose(socket: WebSocket): void {
    if (socket !== this.socket) return;
    this.socket = undefined;
    this.channels.clear();
    this.bySubscription.clear();
    this.published.clear();
    for (const wish of this.wishes) wish.subscription = wish.channel = undefined;
    this.setState("lost");
    this.onChannels();
    window.setTimeout(() => this.connect(), this.retryMs);
    this.retryMs = Math.min(2 * this.retryMs, kLongestRetryMs);
  }

  /** While topics are subscribed but silent, a question that the server answers shows the link. */
  private watch(): void {
    const socket = this.socket;
    if (!socket) return;
    const silence = performance.now() - this.heard;
    if (silence > kSilenceMs) {
      socket.onclose = null;
      socket.close();
      this.lose(socket);
    } else if (silence > kSilenceMs / 2) {
      this.say({ op: "ping" });
    }
  }

  private setState(state: LinkState): void {
    this.state = state;
    this.onState();
  }

  private say(message: object): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  private hear(text: string): void {
    const message = JSON.parse(text) as Record<string, unknown>;
    switch (message.op) {
      case "serverInfo":
        this.canCommand = (message.capabilities as string[]).includes("clientPublish");
        this.setState("open");
        break;
      case "advertise":
        for (const channel of message.channels as Channel[]) this.channels.set(channel.id, channel);
        this.subscribe();
        this.onChannels();
        break;
      case "unadvertise":
        for (const id of message.channelIds as number[]) this.drop(id);
        this.onChannels();
        break;
      case "status":
        if (!String(message.message).startsWith("'ping'")) {
          this.onNotice(message.level as number, String(message.message));
        }
        break;
      default:
        break;
    }
  }

  private drop(id: number): void {
    this.channels.delete(id);
    for (const wish of this.wishes) {
      if (wish.channel !== id) continue;
      if (wish.subscription !== undefined) this.bySubscription.delete(wish.subscription);
      wish.subscription = wish.channel = undefined;
    }
    this.subscribe();
  }

  private find(topic: string): Channel | undefined {
    for (const channel of this.channels.values()) {
      if (channel.topic === topic && channel.encoding === "cdr") return channel;
    }
    return undefined;
  }

  private subscribe(): void {
    if (this.socket?.readyState !== WebSocket.OPEN) return;
    const subscriptions: { id: number; channelId: number }[] = [];
    for (const wish of this.wishes) {
      if (wish.subscription !== undefined) continue;
      const channel = this.find(wish.topic);
      if (!channel) continue;
      wish.subscription = this.nextSubscription++;
      wish.channel = channel.id;
      this.bySubscription.set(wish.subscription, wish);
      subscriptions.push({ id: wish.subscription, channelId: channel.id });
    }
    if (subscriptions.length > 0) this.say({ op: "subscribe", subscriptions });
  }

  private reader(channel: Channel): MessageReader {
    let reader = this.readers.get(channel.schemaName);
    if (!reader) {
      reader = new MessageReader(parse(channel.schema, { ros2: true }));
      this.readers.set(channel.schemaName, reader);
    }
    return reader;
  }

  private receive(data: ArrayBuffer): void {
    const view = new DataView(data);
    if (view.byteLength < 17 || view.getUint8(0) !== 1) return;
    this.received += 1;
    this.receivedBytes += data.byteLength;
    const wish = this.bySubscription.get(view.getUint32(1, true));
    const channel = wish?.channel === undefined ? undefined : this.channels.get(wish.channel);
    if (!wish || !channel) return;
    let message: unknown;
    try {
      message = this.reader(channel).readMessage(new DataView(data, 13));
    } catch (error) {
      this.onNotice(1, `a message of ${channel.topic} cannot be read: ${String(error)}`);
      return;
    }
    wish.handler(message as never, view.getBigUint64(5, true));
  }
}
