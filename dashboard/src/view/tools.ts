import type { Connection } from "../bus/connection";
import type { OtherTrajectory } from "../model/other_trajectory";
import { toCsv, toTum } from "../model/poses";
import { trajectoryTopics, type Vehicle } from "../model/vehicle";
import { Commands } from "./commands";
import { button, element, fixed, saveFile, setText } from "./dom";
import type { SceneView } from "./scene";

const kKeys: [string, string][] = [
  ["Space", "pause, resume"],
  ["← →", "1 s back, on (Shift: 10 s)"],
  ["L", "back to now"],
  ["1 2 3 4", "orbit, follow, top, side"],
  ["F", "everything in view"],
  ["R", "ruler"],
  ["I", "large picture"],
  ["D", "dark or light"],
  ["V", "next vehicle"],
  ["Esc", "end ruler, picture"],
];

/** Export, second trajectory, commands, keys. */
export class Tools {
  readonly node = element("div");
  readonly commands: Commands;
  private readonly compare = element("select", { "aria-label": "second trajectory" });
  private readonly compareText = element("p", {}, "");
  private readonly link_: HTMLElement = element("p", { class: "num" });
  private vehicle: Vehicle | undefined;
  private offered = "";
  private lastBytes = 0;
  private lastAt = performance.now();

  constructor(
    private readonly link: Connection,
    private readonly other: OtherTrajectory,
    private readonly scene: SceneView,
    notice: (text: string) => void,
  ) {
    this.commands = new Commands(link);
    const file = element("input", { type: "file", accept: ".txt,.tum,.csv,text/plain", hidden: "" });
    file.addEventListener("change", () => {
      const chosen = file.files?.[0];
      file.value = "";
      if (!chosen) return;
      void chosen.text().then((text) => {
        try {
          other.fromFile(chosen.name, text);
        } catch (error) {
          notice(`${chosen.name}: ${error instanceof Error ? error.message : String(error)}`);
        }
      });
    });
    this.compare.addEventListener("change", () => {
      if (this.compare.value === "") other.clear();
      else other.fromTopic(this.compare.value);
    });
    const open = button("Open TUM file…", "Ground truth or a replay: time x y z qx qy qz qw", () => file.click());
    const none = button("None", "Show no second trajectory", () => other.clear());
    this.node.append(
      this.section("Save", element(
        "div",
        { class: "row" },
        button("Trajectory, TUM", "All poses of base_link in odom", () => this.save("txt", toTum)),
        button("Trajectory, CSV", "With state and segment", () => this.save("csv", toCsv)),
        button("Picture, PNG", "The 3D view as it is now", () => void this.savePicture()),
      )),
      this.section("Second trajectory", element("div", { class: "row" }, this.compare, open, none), this.compareText, file),
      this.commands.node,
      this.section("Keys", element(
        "div",
        { class: "keys" },
        ...kKeys.flatMap(([key, what]) => [element("kbd", {}, key), element("span", {}, what)]),
      )),
      this.section("Connection", this.link_),
    );
  }

  update(vehicle: Vehicle | undefined): void {
    this.vehicle = vehicle;
    this.commands.update(vehicle);
    if (this.node.offsetParent === null) return;
    this.offerTopics(vehicle);
    const { name, rms } = this.other;
    setText(
      this.compareText,
      name === ""
        ? "Ground truth, a replay, or another vehicle, drawn in blue."
        : rms === undefined
          ? `${name}: drawn as it is`
          : `${name}: laid over the own one; ${fixed(rms, 3)} m apart (RMS)`,
    );
    const now = performance.now();
    if (now - this.lastAt > 1000) {
      const rate = (this.link.receivedBytes - this.lastBytes) / (now - this.lastAt);
      this.lastBytes = this.link.receivedBytes;
      this.lastAt = now;
      const { length } = vehicle?.poses ?? { length: 0 };
      setText(
        this.link_,
        `${fixed(rate, 0)} kB/s · ${this.link.channels.size} topics · ${length} poses · ` +
          `${vehicle?.map.count ?? 0} map points (${fixed((vehicle?.map.voxelSize ?? 0) * 100, 0)} cm) · ` +
          `${fixed(this.scene.framesPerSecond, 0)} frames/s drawn`,
      );
    }
  }

  private section(title: string, ...content: Node[]): HTMLElement {
    return element("div", { class: "section" }, element("h2", {}, title), ...content);
  }

  private offerTopics(vehicle: Vehicle | undefined): void {
    const topics = vehicle ? trajectoryTopics(this.link, vehicle.ns) : [];
    if (topics.join() === this.offered && this.compare.options.length > 0) return;
    this.offered = topics.join();
    this.compare.replaceChildren(
      element("option", { value: "" }, topics.length > 0 ? "Topic…" : "No other topic"),
      ...topics.map((t) => element("option", { value: t }, t)),
    );
  }

  private fileName(kind: string): string {
    const date = new Date().toISOString().slice(0, 19).replaceAll(":", "-");
    return `${(this.vehicle?.name ?? "sovo").replace(/[^\w.-]+/g, "_")}_${date}.${kind}`;
  }

  private save(kind: string, write: (log: Vehicle["poses"]) => string): void {
    if (this.vehicle) saveFile(this.fileName(kind), write(this.vehicle.poses), "text/plain");
  }

  private async savePicture(): Promise<void> {
    saveFile(this.fileName("png"), await this.scene.snapshot(), "image/png");
  }
}
