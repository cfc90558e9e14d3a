import { Connection } from "../bus/connection";
import { OtherTrajectory } from "../model/other_trajectory";
import { Vehicle, vehiclesOf } from "../model/vehicle";
import { kLevelColors, kStates } from "../model/words";
import { Banner } from "./banner";
import { button, element, icon, setText } from "./dom";
import { HealthList } from "./health";
import { LargePicture, PictureView } from "./pictures";
import { Plots } from "./plots";
import { isSoftwareRendering } from "./rendering";
import { type LayerName, SceneView, type ViewName } from "./scene";
import { Timeline } from "./timeline";
import { Tools } from "./tools";

type TabName = "plots" | "health" | "tools";

const kViews: [ViewName, string][] = [
  ["orbit", "Orbit"],
  ["follow", "Follow"],
  ["top", "Top"],
  ["side", "Side"],
];
const kLayers: [LayerName, string][] = [
  ["map", "Map"],
  ["points", "Window"],
  ["keyframes", "Keyframes"],
  ["picture", "Picture"],
  ["grid", "Grid"],
];
const kSpans: [number, string][] = [
  [60, "1 min"],
  [180, "3 min"],
  [600, "10 min"],
];
const kUpdateMs = 100;
const kMostNotices = 4;

/** The whole page. */
export class App {
  private readonly link: Connection;
  private readonly other: OtherTrajectory;
  private readonly banner = new Banner();
  private readonly scene: SceneView;
  private readonly left = new PictureView("left", () => this.large.show("left"));
  private readonly right = new PictureView("right", () => this.large.show("right"));
  private readonly large = new LargePicture();
  private readonly plots = new Plots();
  private readonly health = new HealthList();
  private readonly tools: Tools;
  private readonly timeline = new Timeline();
  private readonly chooser = element("select", { "aria-label": "vehicle", title: "Vehicle (V)" });
  private readonly veil = element("div", { class: "veil" });
  private readonly notices = element("div", { class: "notices", role: "log" });
  private readonly gridText = element("span");
  private readonly detailText = element("span");
  private readonly scaleBar = element("div", { class: "scale-bar" });
  private readonly scaleText = element("span", { class: "num" });
  private readonly badge = element("span", { class: "badge num" });
  private readonly tabs = new Map<TabName, { button: HTMLButtonElement; page: HTMLElement }>();
  private readonly viewButtons = new Map<ViewName, HTMLButtonElement>();
  private vehicle: Vehicle | undefined;
  private hovered: number | undefined;
  private updates = 0;
  private plotted = "";
  private readonly software = isSoftwareRendering();

  constructor(url: string) {
    applyTheme(savedTheme());
    this.link = new Connection(url);
    this.other = new OtherTrajectory(this.link);
    const host = element("div", { class: "scene" });
    document.body.append(this.layout(host));
    this.scene = new SceneView(host, this.software);
    this.tools = new Tools(this.link, this.other, this.scene, (text) => this.notice(1, text));
    host.append(this.sceneTools(), this.legend(), this.large.node, this.veil);
    this.fillSide();
    this.wire();
    this.plots.rebuild();
    this.setView("orbit");
    this.updateAgain();
  }

  private layout(host: HTMLElement): HTMLElement {
    const brand = element("div", { class: "brand" }, logo(), element("span", {}, "sovo"));
    const theme = button("", "Dark or light (D)", () => this.toggleTheme());
    theme.append(icon("M12 3a9 9 0 1 0 0 18a9 9 0 0 0 0-18zM12 3v18M12 8h7M12 12h9M12 16h7"));
    const full = button("", "Full screen", () => void toggleFullScreen());
    full.append(icon("M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5"));
    const tools = element("div", { class: "tools" }, theme, full);
    this.chooser.addEventListener("change", () => this.choose(this.chooser.value));
    const banner = element("header", { class: "banner" });
    banner.append(brand, this.chooser, this.banner.state, this.banner.figures, tools);
    const side = element("aside", { class: "side" });
    const app = element("div", { class: "app" }, banner, host, side, this.timeline.node);
    app.append(this.notices);
    return app;
  }

  private fillSide(): void {
    const side = document.querySelector(".side")!;
    const bar = element("div", { class: "tabs", role: "tablist" });
    const pages: [TabName, string, HTMLElement][] = [
      ["plots", "Plots", this.plots.node],
      ["health", "Health", this.health.node],
      ["tools", "Tools", this.tools.node],
    ];
    const body = element("div", { class: "pages" });
    body.style.minHeight = "0";
    body.style.display = "grid";
    for (const [name, title, content] of pages) {
      const page = element("div", { class: "page" }, content);
      const tab = button(title, title, () => this.setTab(name));
      if (name === "health") tab.append(this.badge);
      this.tabs.set(name, { button: tab, page });
      bar.append(tab);
      body.append(page);
    }
    const spans = element("span", { class: "span" });
    for (const [seconds, label] of kSpans) {
      const choose = button(label, `Plots over ${label}`, () => {
        this.plots.span = seconds;
        for (const other of spans.children) other.classList.toggle("on", other === choose);
      });
      choose.classList.toggle("on", seconds === this.plots.span);
      spans.append(choose);
    }
    bar.append(spans);
    side.append(element("div", { class: "pictures" }, this.left.node, this.right.node), bar, body);
    this.setTab("plots");
  }

  private sceneTools(): HTMLElement {
    const views = element("div", { class: "group" });
    for (const [name, label] of kViews) {
      const node = button(label, `${label} view (${this.viewButtons.size + 1})`, () => this.setView(name));
      this.viewButtons.set(name, node);
      views.append(node);
    }
    views.append(button("Fit", "Everything in view (F)", () => this.scene.fit()));
    const layers = element("div", { class: "group" });
    for (const [name, label] of kLayers) {
      const node = button(label, `Show or hide: ${label}`, () => {
        const on = node.classList.toggle("on");
        this.scene.setLayer(name, on);
      });
      node.classList.add("on");
      layers.append(node);
    }
    const ruler = button("Ruler", "Distance between two clicked points (R)", () =>
      this.scene.setRuling(!this.scene.ruling),
    );
    this.scene.onRuler = (on) => ruler.classList.toggle("on", on);
    return element("div", { class: "overlay top" }, views, layers, element("div", { class: "group" }, ruler));
  }

  private legend(): HTMLElement {
    const states = element("div", { class: "row" });
    for (const index of [1, 2, 3, 4]) {
      const state = kStates[index]!;
      const key = element("span", { class: "key" }, state.name);
      key.style.setProperty("--key", `var(${state.color})`);
      states.append(key);
    }
    const scale = element("div", { class: "row" }, this.scaleBar, this.scaleText, this.gridText, this.detailText);
    return element("div", { class: "legend" }, states, scale);
  }

  private wire(): void {
    this.link.onState = () => this.refreshVehicles();
    this.link.onChannels = () => this.refreshVehicles();
    this.link.onNotice = (level, message) => this.notice(level, message);
    this.plots.onCursor = (time) => {
      this.hovered = time;
    };
    this.timeline.onChange = () => {
      this.hovered = undefined;
    };
    this.scene.timeShown = () => this.hovered ?? this.timeline.held ?? this.vehicle?.now ?? NaN;
    this.other.onChange = (poses) => this.scene.setOther(poses);
    window.addEventListener("keydown", (e) => this.key(e));
    this.plots.node.addEventListener("pointerleave", () => {
      this.hovered = undefined;
    });
  }

  private refreshVehicles(): void {
    const names = vehiclesOf(this.link);
    const current = this.vehicle?.ns;
    // One that has gone stays on the page: its processes may come back.
    const all = current !== undefined && !names.includes(current) ? [...names, current] : names;
    const same = [...this.chooser.options].map((o) => o.value).join() === all.join();
    if (!same) {
      this.chooser.replaceChildren(
        ...all.map((ns) => element("option", { value: ns }, ns.slice(1).replace(/^domain_(\d+)\//, "domain $1 · "))),
      );
    }
    this.chooser.hidden = all.length === 0;
    if (!this.vehicle && names.length > 0) this.choose(names[0]!);
    if (current !== undefined) this.chooser.value = current;
  }

  private choose(ns: string): void {
    if (this.vehicle?.ns === ns) return;
    this.vehicle?.end();
    const mostMapPoints = this.software ? 12_000 : 250_000;
    this.vehicle = new Vehicle(this.link, ns, mostMapPoints, (text) => this.notice(1, text));
    this.scene.setVehicle(this.vehicle);
    this.timeline.hold(undefined);
    this.chooser.value = ns;
    document.title = `${this.vehicle.name} – sovo`;
  }

  private setTab(name: TabName): void {
    for (const [key, { button: tab, page }] of this.tabs) {
      tab.classList.toggle("on", key === name);
      page.classList.toggle("on", key === name);
    }
  }

  private setView(view: ViewName): void {
    this.scene.setView(view);
    for (const [name, node] of this.viewButtons) node.classList.toggle("on", name === view);
  }

  private toggleTheme(): void {
    applyTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
    this.scene.applyTheme();
    this.plots.rebuild();
  }

  private notice(level: number, text: string): void {
    const last = this.notices.lastElementChild;
    if (last?.textContent === text) return;
    const node = element("div", { class: "notice" }, text);
    node.style.setProperty("--level", `var(${kLevelColors[level] ?? "--amber"})`);
    this.notices.append(node);
    while (this.notices.children.length > kMostNotices) this.notices.firstElementChild!.remove();
    window.setTimeout(() => node.remove(), 8000);
  }

  /** Updates may take a third of the time: on a slow machine there are fewer. */
  private updateAgain(): void {
    const begin = performance.now();
    this.update();
    const took = performance.now() - begin;
    window.setTimeout(() => this.updateAgain(), Math.max(kUpdateMs - took, 2 * took));
  }

  /** Ten times a second: everything follows the newest data, or the time that is held. */
  private update(): void {
    const vehicle = this.vehicle;
    this.timeline.update(vehicle);
    const newest = vehicle?.now ?? NaN;
    const held = this.timeline.held ?? newest;
    const at = this.hovered ?? held;
    const live = this.timeline.isLive && this.hovered === undefined;
    this.banner.update(this.link, vehicle, at, live);
    this.updatePlots(vehicle, held, at);
    this.left.update(vehicle, at, live);
    this.right.update(vehicle, at, live);
    this.large.update(vehicle, at);
    this.health.update(vehicle);
    this.tools.update(vehicle);
    this.showHealthBadge(vehicle);
    this.showScale();
    this.showVeil(vehicle);
    if (++this.updates % 10 === 0) this.other.update(vehicle?.poses);
  }

  /** Curves are the dearest part of the page: they move on half as often as figures do. */
  private updatePlots(vehicle: Vehicle | undefined, held: number, at: number): void {
    const asked = [this.hovered, this.timeline.held, this.plots.span].join();
    if (this.updates % 2 !== 0 && asked === this.plotted) return;
    this.plotted = asked;
    this.plots.update(vehicle, held, at);
  }

  private showHealthBadge(vehicle: Vehicle | undefined): void {
    const { level, count } = this.health.summary(vehicle);
    this.badge.hidden = count === 0;
    setText(this.badge, String(count));
    this.badge.style.setProperty("--badge", `var(${kLevelColors[level] ?? "--grey"})`);
  }

  private showScale(): void {
    const target = this.scene.metresPerPixel * 110;
    const exponent = 10 ** Math.floor(Math.log10(target));
    const length = [5, 2, 1].map((m) => m * exponent).find((m) => m <= target) ?? exponent;
    this.scaleBar.style.width = `${length / this.scene.metresPerPixel}px`;
    setText(this.scaleText, length >= 1 ? `${length.toFixed(0)} m` : `${(length * 100).toFixed(0)} cm`);
    setText(this.gridText, this.scene.gridText);
    setText(this.detailText, this.scene.detailText);
  }

  private showVeil(vehicle: Vehicle | undefined): void {
    const lost = this.link.state === "lost";
    this.veil.classList.toggle("on", lost || (!vehicle?.status && !lost));
    if (!this.veil.classList.contains("on")) return;
    const [title, text] = lost
      ? ["Connection lost", "The dashboard process cannot be reached. What was seen stays here; the page connects again by itself."]
      : vehicle
        ? ["Waiting for the first frame", `${vehicle.name} is there, but no frame has been tracked yet.`]
        : ["No vehicle yet", "Start sovo vo and a camera in this domain, on a network that both share: they appear here by themselves."];
    if (this.veil.firstElementChild?.textContent === title + text) return;
    this.veil.replaceChildren(element("div", {}, element("h1", {}, title), element("p", {}, text)));
  }

  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.metaKey || event.altKey || target.tagName === "SELECT") return;
    if (document.querySelector("dialog[open]")) return;
    const actions: Record<string, () => void> = {
      " ": () => this.timeline.toggle(),
      ArrowLeft: () => this.timeline.step(event.shiftKey ? -10 : -1),
      ArrowRight: () => this.timeline.step(event.shiftKey ? 10 : 1),
      l: () => this.timeline.hold(undefined),
      "1": () => this.setView("orbit"),
      "2": () => this.setView("follow"),
      "3": () => this.setView("top"),
      "4": () => this.setView("side"),
      f: () => this.scene.fit(),
      r: () => this.scene.setRuling(!this.scene.ruling),
      i: () => this.large.show(this.large.side ?? "left"),
      d: () => this.toggleTheme(),
      v: () => this.nextVehicle(),
      Escape: () => {
        this.scene.setRuling(false);
        this.large.show(undefined);
      },
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  private nextVehicle(): void {
    const names = vehiclesOf(this.link);
    if (names.length === 0) return;
    this.choose(names[(names.indexOf(this.vehicle?.ns ?? "") + 1) % names.length]!);
  }
}

function logo(): SVGSVGElement {
  const kSvg = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(kSvg, "svg");
  svg.setAttribute("viewBox", "0 0 32 32");
  const path = document.createElementNS(kSvg, "path");
  path.setAttribute("d", "M3 22c6 0 5-13 12-13s4 10 13 7");
  path.setAttribute("fill", "none");
  path.setAttribute("stroke", "var(--teal)");
  path.setAttribute("stroke-width", "3");
  path.setAttribute("stroke-linecap", "round");
  const dot = document.createElementNS(kSvg, "circle");
  dot.setAttribute("cx", "28");
  dot.setAttribute("cy", "16");
  dot.setAttribute("r", "3");
  dot.setAttribute("fill", "var(--text)");
  svg.append(path, dot);
  return svg;
}

function savedTheme(): string {
  const asked = new URLSearchParams(location.search).get("theme");
  const system = matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark";
  return asked ?? localStorage.getItem("theme") ?? system;
}

function applyTheme(theme: string): void {
  document.documentElement.dataset.theme = theme === "light" ? "light" : "dark";
  localStorage.setItem("theme", theme);
}

async function toggleFullScreen(): Promise<void> {
  if (document.fullscreenElement) await document.exitFullscreen();
  else await document.documentElement.requestFullscreen();
}
