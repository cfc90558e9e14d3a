import type { Connection } from "../bus/connection";
import type { Vehicle } from "../model/vehicle";
import { button, element, setText } from "./dom";

const kVoSchema = `uint8 RESET=1
uint8 PAUSE=2
uint8 RESUME=3
builtin_interfaces/Time stamp
uint64 id
uint8 command
geometry_msgs/Pose pose
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w`;
const kRecorderSchema = `uint8 START=1
uint8 STOP=2
builtin_interfaces/Time stamp
uint64 id
uint8 command
string name
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec`;

const kPatienceMs = 5000;

/** Buttons that tell the vehicle what to do; each asks first, and shows the answer. */
export class Commands {
  readonly node = element("div", { class: "section" });
  private readonly answer = element("p", {}, "");
  private readonly buttons: HTMLButtonElement[];
  private readonly hint = element("p", {});
  private waiting: { id: bigint; what: string; until: number; recorder: boolean } | undefined;
  private vehicle: Vehicle | undefined;

  constructor(private readonly link: Connection) {
    const vo = (label: string, command: number, question: string, danger = false) => {
      const node = button(label, question, () => this.ask(label, question, danger, () => this.tell(label, command)));
      if (danger) node.classList.add("danger");
      return node;
    };
    const record = (label: string, command: number, question: string) =>
      button(label, question, () => this.ask(label, question, false, () => this.record(label, command)));
    this.buttons = [
      vo("Reset", 1, "The map is forgotten and a new segment begins at the last pose.", true),
      vo("Pause odometry", 2, "Frames are left unprocessed until it is resumed."),
      vo("Resume odometry", 3, "Frames are processed again."),
      record("Start recording", 1, "A new recording begins on the machine that runs sovo record."),
      record("Stop recording", 2, "The recording is ended and closed."),
    ];
    this.node.append(element("h2", {}, "Commands"), this.hint);
    this.node.append(element("div", { class: "row" }, ...this.buttons), this.answer);
  }

  update(vehicle: Vehicle | undefined): void {
    this.vehicle = vehicle;
    const able = this.link.canCommand && vehicle !== undefined && this.link.state === "open";
    if (able) {
      this.link.advertise(`${vehicle.ns}/command`, "sovo_msgs/msg/VoCommand", kVoSchema);
      this.link.advertise(`${vehicle.ns}/record_command`, "sovo_msgs/msg/RecorderCommand", kRecorderSchema);
    }
    setText(
      this.hint,
      this.link.canCommand
        ? "Each asks before it is sent."
        : "This page only shows. sovo dashboard --allow-commands --token-file FILE lets it command.",
    );
    for (const node of this.buttons) node.disabled = !able;
    this.watchAnswer(vehicle);
  }

  private watchAnswer(vehicle: Vehicle | undefined): void {
    if (!this.waiting || !vehicle) return;
    const { id, what, until, recorder } = this.waiting;
    if (recorder && vehicle.recorder?.last_command_id === id) {
      const { recording, file, reason } = vehicle.recorder;
      setText(this.answer, `${what}: ${recording ? `recording ${file}` : reason || "stopped"}`);
    } else if (!recorder && vehicle.status?.last_command_id === id) {
      setText(this.answer, `${what}: ${vehicle.status.last_command_result}`);
    } else if (performance.now() > until) {
      setText(this.answer, `${what}: no answer within 5 s; it obeys other machines only with dds.accept_commands`);
    } else {
      return;
    }
    this.waiting = undefined;
  }

  private ask(title: string, question: string, danger: boolean, go: () => void): void {
    const dialog = element("dialog");
    const close = () => {
      dialog.close();
      dialog.remove();
    };
    const yes = button(title, title, () => {
      close();
      go();
    });
    yes.classList.add(danger ? "danger" : "on");
    const no = button("Cancel", "Cancel", close);
    const heading = `${title}: ${this.vehicle?.name ?? ""}?`;
    dialog.append(element("h1", {}, heading), element("p", {}, question));
    dialog.append(element("div", { class: "row" }, no, yes));
    dialog.addEventListener("close", () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
    no.focus();
  }

  private header(): { stamp: { sec: number; nanosec: number }; id: bigint } {
    const now = Date.now();
    const random = crypto.getRandomValues(new BigUint64Array(1))[0]!;
    return { stamp: { sec: Math.floor(now / 1000), nanosec: (now % 1000) * 1e6 }, id: random };
  }

  private tell(what: string, command: number): void {
    const zero = { x: 0, y: 0, z: 0 };
    const pose = { position: zero, orientation: { ...zero, w: 0 } };
    const message = { ...this.header(), command, pose };
    this.send("command", what, message, false);
  }

  private record(what: string, command: number): void {
    const message = { ...this.header(), command, name: "" };
    this.send("record_command", what, message, true);
  }

  private send(
    topic: string,
    what: string,
    message: { id: bigint; command: number },
    recorder: boolean,
  ): void {
    if (!this.vehicle) return;
    const sent = this.link.publish(`${this.vehicle.ns}/${topic}`, message);
    setText(this.answer, sent ? `${what}: sent` : `${what}: not sent, the connection is closed`);
    if (sent) this.waiting = { id: message.id, what, until: performance.now() + kPatienceMs, recorder };
  }
}
