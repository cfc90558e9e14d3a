import type { Connection } from "../bus/connection";
import type { Vehicle } from "../model/vehicle";
import { stateWords } from "../model/words";
import { element, fixed, setText } from "./dom";

const kStaleMs = 1000;

class Figure {
  readonly node: HTMLElement;
  private readonly value = element("span");
  constructor(label: string, unit: string, minor = false) {
    this.node = element(
      "div",
      { class: minor ? "figure minor" : "figure" },
      element("span", { class: "label" }, label),
      element("span", { class: "value" }, this.value, element("span", { class: "unit" }, unit)),
    );
  }
  set(text: string, stale: boolean): void {
    setText(this.value, text);
    this.node.classList.toggle("stale", stale);
  }
}

/** The state in words with its reason, and the numbers that are looked at first. */
export class Banner {
  readonly state = element("div", { class: "state", role: "status", "aria-live": "polite" });
  readonly figures = element("div", { class: "figures" });
  private readonly name = element("span", { class: "name" });
  private readonly age = element("span", { class: "age num" });
  private readonly reason = element("div", { class: "reason" });
  private readonly speed = new Figure("Speed", "m/s");
  private readonly depth = new Figure("Depth, −z", "m");
  private readonly distance = new Figure("Travelled", "m");
  private readonly scale = new Figure("Scale 2σ", "%", true);
  private readonly latency = new Figure("Latency", "ms", true);
  private readonly rate = new Figure("Rate", "Hz");

  constructor() {
    const words = element("div", { class: "words" });
    words.append(element("div", {}, this.name, "  ", this.age), this.reason);
    this.state.append(element("span", { class: "lamp" }), words);
    const all = [this.speed, this.depth, this.distance, this.scale, this.latency, this.rate];
    this.figures.append(...all.map((f) => f.node));
  }

  update(link: Connection, vehicle: Vehicle | undefined, time: number, live: boolean): void {
    const now = performance.now();
    const age = vehicle ? now - vehicle.statusHeard : Infinity;
    const stale = live && age > kStaleMs;
    this.showState(link, vehicle, time, live, age);
    const poseRow = vehicle?.poseTable.at(time) ?? -1;
    const statusRow = vehicle?.statusTable.at(time) ?? -1;
    const pose = (column: "speed" | "depth" | "scaleHigh" | "scale") =>
      vehicle?.poseTable.get(column, poseRow) ?? NaN;
    const status = (column: "latency" | "rate" | "distance") => vehicle?.statusTable.get(column, statusRow) ?? NaN;
    const poseStale = live && (!vehicle || now - vehicle.poseHeard > kStaleMs);
    this.speed.set(fixed(pose("speed"), 2), poseStale);
    this.depth.set(fixed(pose("depth"), 2), poseStale);
    this.distance.set(fixed(status("distance"), 1), stale);
    this.scale.set(fixed((pose("scaleHigh") / pose("scale") - 1) * 100, 1), poseStale);
    this.latency.set(fixed(status("latency"), 0), stale);
    this.rate.set(stale ? "0.0" : fixed(status("rate"), 1), stale);
  }

  private showState(
    link: Connection,
    vehicle: Vehicle | undefined,
    time: number,
    live: boolean,
    age: number,
  ): void {
    let [name, reason, color] = ["No odometry", "waiting for sovo vo to speak", "--grey"];
    let [alarm, note] = [false, ""];
    if (link.state !== "open") {
      [name, color, alarm] = ["Not connected", "--red", true];
      reason = "the dashboard process cannot be reached; trying again";
    } else if (vehicle?.status) {
      const row = vehicle.statusTable.at(time);
      const state = live ? vehicle.status.state : vehicle.statusTable.get("state", row);
      const words = stateWords(state);
      [name, color] = [words.name, words.color];
      alarm = state === 2 || state === 3 || state === 4;
      const parts = live ? [vehicle.status.reason, words.advice] : [];
      reason = parts.filter((p) => p !== "").join(" · ");
      if (live && state === 1 && reason === "") {
        reason = `pose and scale are good · segment ${vehicle.status.segment}, ${vehicle.status.keyframes} keyframes and ${vehicle.status.points} points in the window`;
      }
      if (live && age > kStaleMs) {
        [color, alarm] = ["--grey", false];
        note = `last heard ${age < 60_000 ? `${fixed(age / 1000, 1)} s` : `${fixed(age / 60_000, 0)} min`} ago`;
        if (age > 3000) reason = "no frames come: check sovo vo and the camera · " + reason;
      }
    }
    setText(this.name, name);
    setText(this.age, note);
    setText(this.reason, reason);
    this.reason.title = reason;
    this.state.style.setProperty("--state", `var(${color})`);
    this.state.classList.toggle("alarm", alarm);
  }
}
