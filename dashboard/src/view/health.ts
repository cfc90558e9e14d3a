import type { Vehicle } from "../model/vehicle";
import { healthAdvice, kLevelColors, kLevels } from "../model/words";
import { element, fixed } from "./dom";

const kStaleMs = 3500;

/** What every process says about itself, the worst first, with what to do. */
export class HealthList {
  readonly node = element("div", { class: "entries" });
  private shown = "";

  /** Worst level, and how many entries are not fine. */
  summary(vehicle: Vehicle | undefined): { level: number; count: number } {
    let [level, count] = [0, 0];
    for (const entry of vehicle?.health.values() ?? []) {
      const now = this.level(entry);
      if (now > 0) count += 1;
      level = Math.max(level, now);
    }
    return { level, count };
  }

  update(vehicle: Vehicle | undefined): void {
    if (this.node.offsetParent === null) return;
    const entries = [...(vehicle?.health.values() ?? [])];
    entries.sort((a, b) => this.level(b) - this.level(a) || a.name.localeCompare(b.name));
    const key = entries
      .map((e) => [e.name, this.level(e), e.heard, this.level(e) === 3 ? this.age(e.heard) : ""].join())
      .join("|");
    if (key === this.shown && entries.length > 0) return;
    this.shown = key;
    if (entries.length === 0) {
      this.node.replaceChildren(
        element("p", { class: "message" }, "No process has reported on /diagnostics yet."),
      );
      return;
    }
    this.node.replaceChildren(
      ...entries.map((entry) => {
        const level = this.level(entry);
        const top = element(
          "div",
          { class: "top" },
          element("span", { class: "who" }, entry.name),
          element("span", { class: "level" }, kLevels[level] ?? "?"),
          element("span", { class: "age num" }, level === 3 ? this.age(entry.heard) : ""),
        );
        const node = element("div", { class: "entry" }, top);
        node.style.setProperty("--level", `var(${kLevelColors[level] ?? "--grey"})`);
        node.append(element("div", { class: "message" }, entry.message));
        const advice =
          level === 3 && entry.level !== 3
            ? "It says nothing any more: is the process running?"
            : healthAdvice(level, entry.message);
        if (advice !== "") node.append(element("div", { class: "do" }, advice));
        const pairs = entry.values.map(({ key: name, value }) =>
          element("div", {}, element("span", {}, name), element("span", { class: "num" }, tidy(value))),
        );
        if (pairs.length > 0) node.append(element("div", { class: "pairs" }, ...pairs));
        return node;
      }),
    );
  }

  private level(entry: { level: number; heard: number }): number {
    return performance.now() - entry.heard > kStaleMs ? 3 : entry.level;
  }

  private age(heard: number): string {
    return `${fixed((performance.now() - heard) / 1000, 0)} s ago`;
  }
}

/** Long decimals shortened. */
function tidy(value: string): string {
  return /^-?\d+\.\d{4,}$/.test(value) ? String(Number(Number(value).toPrecision(4))) : value;
}
