import {
  BufferAttribute,
  BufferGeometry,
  Color,
  Line,
  LineBasicMaterial,
  LineDashedMaterial,
  OrthographicCamera,
  PerspectiveCamera,
  Plane,
  Points,
  PointsMaterial,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

import type { Pose } from "../bus/messages";
import type { Vehicle } from "../model/vehicle";
import { kStates } from "../model/words";
import { element, themeColor } from "./dom";
import { GrowingLine } from "./growing_line";
import {
  CameraMarker,
  GroundGrid,
  KeyframeMarkers,
  MapCloud,
  placeAt,
  viewCorners,
} from "./scene_objects";

export type ViewName = "orbit" | "follow" | "top" | "side";
export type LayerName = "trajectory" | "map" | "points" | "keyframes" | "grid" | "picture";

const kFrameMs = 1000 / 30;
/** With many keyframes, their marks are made anew this often at most. */
const kKeyframesMs = 1000;

/** The room that the vehicle moves in. */
export class SceneView {
  view: ViewName = "orbit";
  ruling = false;
  framesPerSecond = 0;
  onRuler: (on: boolean) => void = () => {};
  readonly canvas = element("canvas", { class: "gl", tabindex: "0", "aria-label": "3D view" });

  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly eye = new PerspectiveCamera(48, 1, 0.02, 8000);
  private readonly plan = new OrthographicCamera(-1, 1, 1, -1, -4000, 4000);
  private readonly controls: OrbitControls;
  private readonly planControls: OrbitControls;
  private readonly line = new GrowingLine(3);
  private readonly pathLine = new GrowingLine(1.5, 0.5);
  private readonly otherLine = new GrowingLine(2, 0.9);
  private readonly marker = new CameraMarker();
  private readonly keyframes: KeyframeMarkers;
  private readonly grid = new GroundGrid();
  private readonly window: Points<BufferGeometry, PointsMaterial>;
  private readonly plumb: Line<BufferGeometry, LineDashedMaterial>;
  private readonly rulerLine: Line<BufferGeometry, LineBasicMaterial>;
  private readonly rulerLabel = element("div", { class: "ruler-label num" });
  private readonly rulerPoints: Vector3[] = [];
  private cloud: MapCloud | undefined;
  private vehicle: Vehicle | undefined;
  private other: Pose[] = [];
  private otherRevision = 0;
  private drawnOther = -1;
  private drawnPoses = 0;
  private drawnRevision = -1;
  private drawnKeyframes = -1;
  private drawnKeyframeSize = 0;
  private keyframesAt = 0;
  private stateColors: Color[] = [];
  private drawMs = 0;
  private lastTick = 0;
  private drewLast = false;
  private drawnWindow = -1;
  private drawnPath: unknown;
  private drawnCalibration: unknown;
  private lastPoint = new Vector3();
  private lastSegment = -1;
  private touched = false;
  private dirty = true;
  private lastFrame = 0;
  private readonly followed = new Vector3();
  private frames: number[] = [];

  constructor(
    private readonly host: HTMLElement,
    software: boolean,
  ) {
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: !software });
    this.renderer.setPixelRatio(software ? 1 : Math.min(window.devicePixelRatio, 2));
    this.keyframes = new KeyframeMarkers(software ? 150 : 1500);
    host.prepend(this.canvas);
    host.append(this.rulerLabel);
    this.rulerLabel.hidden = true;
    this.window = new Points(
      new BufferGeometry(),
      new PointsMaterial({ size: 3, sizeAttenuation: false }),
    );
    this.window.frustumCulled = false;
    this.plumb = new Line(
      new BufferGeometry(),
      new LineDashedMaterial({ dashSize: 0.1, gapSize: 0.1, transparent: true, opacity: 0.6 }),
    );
    this.rulerLine = new Line(new BufferGeometry(), new LineBasicMaterial({ depthTest: false }));
    this.rulerLine.visible = false;
    this.scene.add(this.grid.object, this.window, this.keyframes.object, this.plumb);
    this.scene.add(this.pathLine.object, this.otherLine.object, this.line.object);
    this.scene.add(this.marker.object, this.rulerLine);
    for (const camera of [this.eye, this.plan]) camera.up.set(0, 0, 1);
    this.eye.position.set(-4, -5, 4);
    this.controls = this.makeControls(this.eye);
    this.planControls = this.makeControls(this.plan);
    this.planControls.enableRotate = false;
    this.planControls.enabled = false;
    this.canvas.addEventListener("pointerdown", (e) => this.pressed(e));
    new ResizeObserver(() => this.resize()).observe(host);
    this.applyTheme();
    this.resize();
    requestAnimationFrame((t) => this.tick(t));
  }

  setVehicle(vehicle: Vehicle | undefined): void {
    if (this.cloud) this.scene.remove(this.cloud.object);
    this.vehicle = vehicle;
    this.cloud = vehicle ? new MapCloud(vehicle.map) : undefined;
    if (this.cloud) this.scene.add(this.cloud.object);
    this.drawnRevision = -1;
    this.drawnKeyframes = -1;
    this.drawnWindow = -1;
    this.drawnPath = undefined;
    this.touched = false;
    this.dirty = true;
  }

  /** A second trajectory; empty: none. */
  setOther(poses: Pose[]): void {
    this.other = poses;
    this.otherRevision += 1;
    this.dirty = true;
  }

  setLayer(layer: LayerName, on: boolean): void {
    if (layer === "trajectory") this.line.object.userData.off = !on;
    if (layer === "map" && this.cloud) this.cloud.object.visible = on;
    if (layer === "points") this.window.visible = on;
    if (layer === "keyframes") this.keyframes.object.visible = on;
    if (layer === "grid") this.grid.object.visible = on;
    if (layer === "picture") this.marker.object.userData.noPicture = !on;
    this.dirty = true;
  }

  get gridText(): string {
    return `grid ${Number(this.grid.step.toPrecision(1))} m, at z = 0 of odom`;
  }

  /** Metres that one pixel of the page spans at the place looked at. */
  get metresPerPixel(): number {
    const height = this.host.clientHeight || 1;
    if (this.isPlan) return (this.plan.top - this.plan.bottom) / this.plan.zoom / height;
    const distance = this.eye.position.distanceTo(this.controls.target);
    return (2 * distance * Math.tan((this.eye.fov * Math.PI) / 360)) / height;
  }

  setView(view: ViewName): void {
    const target = this.activeControls.target.clone();
    const span = this.metresPerPixel * this.host.clientHeight;
    this.view = view;
    this.controls.enabled = !this.isPlan;
    this.planControls.enabled = this.isPlan;
    if (this.isPlan) {
      this.planControls.target.copy(target);
      const away = view === "top" ? new Vector3(0, -1e-4, 1) : new Vector3(0, -1, 0);
      this.plan.position.copy(target).addScaledVector(away, 500);
      this.plan.zoom = 1;
      this.setPlanSpan(span);
      this.planControls.update();
      if (!this.touched) this.fit();
    } else {
      this.controls.target.copy(target);
      if (view === "follow") this.startFollowing();
      else if (!this.touched) this.fit();
      this.controls.update();
    }
    this.dirty = true;
  }

  /** Everything that was travelled comes into view. */
  fit(): void {
    const poses = this.vehicle?.poses;
    const low = new Vector3(-1, -1, -0.5);
    const high = new Vector3(1, 1, 0.5);
    const step = Math.max(1, Math.floor((poses?.length ?? 0) / 2000));
    for (let i = 0; poses && i < poses.length; i += step) {
      const p = new Vector3(poses.x(i), poses.y(i), poses.z(i));
      low.min(p);
      high.max(p);
    }
    for (const { pose } of this.vehicle?.path?.poses ?? []) {
      low.min(pose.position as Vector3);
      high.max(pose.position as Vector3);
    }
    const centre = low.clone().add(high).multiplyScalar(0.5);
    const radius = Math.max(high.distanceTo(low) / 2, 1);
    const controls = this.activeControls;
    const away = controls.object.position.clone().sub(controls.target).normalize();
    controls.target.copy(centre);
    if (this.isPlan) {
      this.plan.position.copy(centre).addScaledVector(away, 500);
      this.plan.zoom = 1;
      this.setPlanSpan(radius * 2.3);
    } else {
      const aspect = Math.min(this.eye.aspect, 1.4);
      this.eye.position.copy(centre).addScaledVector(away, (radius * 2.7) / Math.min(aspect, 1));
    }
    controls.update();
    this.dirty = true;
  }

  applyTheme(): void {
    this.stateColors = kStates.map((s) => new Color(themeColor(s.color)));
    this.scene.background = new Color(themeColor("--scene"));
    this.grid.setColors(themeColor("--grid"), themeColor("--grid-strong"));
    this.window.material.color.set(themeColor("--amber"));
    this.keyframes.setColor(themeColor("--dim"));
    this.plumb.material.color.set(themeColor("--faint"));
    this.rulerLine.material.color.set(themeColor("--amber"));
    this.cloud?.redraw();
    this.drawnRevision = -1;
    this.drawnOther = -1;
    this.drawnPath = undefined;
    this.dirty = true;
  }

  setRuling(on: boolean): void {
    this.ruling = on;
    this.rulerPoints.length = 0;
    this.rulerLine.visible = false;
    this.rulerLabel.hidden = true;
    this.canvas.style.cursor = on ? "crosshair" : "";
    this.onRuler(on);
    this.dirty = true;
  }

  /** The picture as PNG. */
  async snapshot(): Promise<Blob> {
    this.draw();
    return await new Promise((resolve, reject) => {
      this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("no picture"))));
    });
  }

  /** Brings the objects up to date; `time` is where the vehicle is shown. */
  update(time: number): void {
    const vehicle = this.vehicle;
    if (!vehicle) return;
    this.updateTrajectory(vehicle);
    this.updatePath(vehicle);
    this.updateOther();
    this.updateMarker(vehicle, time);
    this.updateKeyframes(vehicle);
    this.updatePoints(vehicle);
    if (!this.touched && this.view !== "follow") this.fit();
    this.dirty = true;
  }

  private get isPlan(): boolean {
    return this.view === "top" || this.view === "side";
  }

  private get activeControls(): OrbitControls {
    return this.isPlan ? this.planControls : this.controls;
  }

  private makeControls(camera: PerspectiveCamera | OrthographicCamera): OrbitControls {
    const controls = new OrbitControls(camera, this.canvas);
    controls.enableDamping = false;
    controls.zoomToCursor = true;
    controls.maxDistance = 3000;
    controls.addEventListener("change", () => {
      this.dirty = true;
    });
    controls.addEventListener("start", () => {
      this.touched = true;
    });
    return controls;
  }

  private setPlanSpan(height: number): void {
    const aspect = this.host.clientWidth / Math.max(this.host.clientHeight, 1);
    const half = Math.max(height, (height / Math.max(aspect, 0.1)) * 0.9) / 2;
    this.plan.top = half;
    this.plan.bottom = -half;
    this.plan.left = -half * aspect;
    this.plan.right = half * aspect;
    this.plan.updateProjectionMatrix();
  }

  private startFollowing(): void {
    const poses = this.vehicle?.poses;
    if (!poses || poses.length === 0) return;
    const i = poses.length - 1;
    this.followed.set(poses.x(i), poses.y(i), poses.z(i));
    const [x, y, z, w] = poses.orientation(i);
    const yaw = Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
    this.controls.target.copy(this.followed);
    this.eye.position.set(
      this.followed.x - 4.5 * Math.cos(yaw),
      this.followed.y - 4.5 * Math.sin(yaw),
      this.followed.z + 2.4,
    );
  }

  private resize(): void {
    const { clientWidth: w, clientHeight: h } = this.host;
    if (w === 0 || h === 0) return;
    this.renderer.setSize(w, h, false);
    this.eye.aspect = w / h;
    this.eye.updateProjectionMatrix();
    this.setPlanSpan(this.plan.top - this.plan.bottom);
    const size = new Vector2(w, h);
    for (const line of [this.line, this.pathLine, this.otherLine]) line.setResolution(size);
    this.dirty = true;
  }

  private tick(now: number): void {
    requestAnimationFrame((t) => this.tick(t));
    const gap = now - this.lastTick;
    this.lastTick = now;
    // A slow frame delays the next: that is what drawing costs, whoever does it.
    if (this.drewLast) this.drawMs = 0.7 * this.drawMs + 0.3 * (gap < 40 ? 4 : Math.min(gap, 2000));
    this.drewLast = false;
    // Drawing may take half of the time, so that the page stays at hand.
    const pause = Math.max(kFrameMs - 4, 2 * this.drawMs);
    if (!this.dirty || now - this.lastFrame < pause) return;
    this.lastFrame = now;
    this.drewLast = true;
    this.draw();
    this.frames.push(now);
    while (this.frames.length > 0 && this.frames[0]! < now - 2000) this.frames.shift();
    this.framesPerSecond = this.frames.length / 2;
  }

  private draw(): void {
    this.dirty = false;
    const controls = this.activeControls;
    const distance = this.metresPerPixel * this.host.clientHeight;
    this.grid.update(controls.target.x, controls.target.y, distance);
    this.marker.setSize(Math.min(Math.max(distance * 0.075, 0.08), 20));
    if (!this.isPlan) {
      this.eye.near = Math.max(distance / 400, 0.01);
      this.eye.far = Math.max(distance * 60, 200);
      this.eye.updateProjectionMatrix();
    }
    this.renderer.render(this.scene, this.isPlan ? this.plan : this.eye);
    this.placeRulerLabel();
  }

  private updateTrajectory(vehicle: Vehicle): void {
    const poses = vehicle.poses;
    if (this.drawnRevision !== poses.revision) {
      this.line.clear();
      this.drawnRevision = poses.revision;
      this.drawnPoses = 0;
      this.lastSegment = -1;
    }
    const colors = this.stateColors;
    for (; this.drawnPoses < poses.length; ++this.drawnPoses) {
      const i = this.drawnPoses;
      const p = new Vector3(poses.x(i), poses.y(i), poses.z(i));
      const segment = poses.segment(i);
      if (segment !== this.lastSegment) {
        this.lastSegment = segment;
        this.lastPoint.copy(p);
        continue;
      }
      // Pieces shorter than a centimetre would be drawn in vain.
      if (p.distanceToSquared(this.lastPoint) < 1e-4) continue;
      const a = this.lastPoint;
      this.line.push(a.x, a.y, a.z, p.x, p.y, p.z, colors[poses.state(i)] ?? colors[6]!);
      this.lastPoint.copy(p);
    }
    this.line.flush();
    if (this.line.object.userData.off) this.line.object.visible = false;
  }

  /** What was travelled before this page was opened. */
  private updatePath(vehicle: Vehicle): void {
    if (this.drawnPath === vehicle.path) return;
    this.drawnPath = vehicle.path;
    const poses = vehicle.path?.poses.map((p) => p.pose) ?? [];
    this.drawPoses(this.pathLine, poses, new Color(themeColor("--faint")));
  }

  private updateOther(): void {
    if (this.drawnOther === this.otherRevision) return;
    this.drawnOther = this.otherRevision;
    this.drawPoses(this.otherLine, this.other, new Color(themeColor("--blue")));
  }

  private drawPoses(line: GrowingLine, poses: Pose[], color: Color): void {
    line.clear();
    for (let i = 1; i < poses.length; ++i) {
      const [a, b] = [poses[i - 1]!.position, poses[i]!.position];
      line.push(a.x, a.y, a.z, b.x, b.y, b.z, color);
    }
    line.flush();
  }

  private updateMarker(vehicle: Vehicle, time: number): void {
    if (this.drawnCalibration !== vehicle.calibration) {
      this.drawnCalibration = vehicle.calibration;
      this.marker.setCalibration(vehicle.calibration);
      this.drawnKeyframes = -1;
    }
    const i = vehicle.poses.at(time);
    this.marker.object.visible = i >= 0;
    if (i < 0) return;
    const [x, y, z] = [vehicle.poses.x(i), vehicle.poses.y(i), vehicle.poses.z(i)];
    const [qx, qy, qz, qw] = vehicle.poses.orientation(i);
    placeAt(this.marker.object, {
      position: { x, y, z },
      orientation: { x: qx, y: qy, z: qz, w: qw },
    });
    this.marker.setColor(this.stateColors[vehicle.poses.state(i)] ?? this.stateColors[6]!);
    const picture = this.marker.object.userData.noPicture ? undefined : vehicle.left.at(time);
    this.marker.setPicture(picture?.bitmap);
    this.plumb.geometry.setFromPoints([new Vector3(x, y, z), new Vector3(x, y, 0)]);
    this.plumb.computeLineDistances();
    if (this.view === "follow") {
      const delta = new Vector3(x, y, z).sub(this.followed);
      this.followed.add(delta);
      this.eye.position.add(delta);
      this.controls.target.add(delta);
      this.controls.update();
    }
  }

  private updateKeyframes(vehicle: Vehicle): void {
    const size = Math.min(Math.max(this.metresPerPixel * 9, 0.02), 5);
    const resized = size > 1.4 * this.drawnKeyframeSize || size < 0.7 * this.drawnKeyframeSize;
    if (this.drawnKeyframes === vehicle.keyframeRevision && !resized) return;
    const now = performance.now();
    if (vehicle.keyframes.size > 300 && now - this.keyframesAt < kKeyframesMs) return;
    this.keyframesAt = now;
    this.drawnKeyframes = vehicle.keyframeRevision;
    this.drawnKeyframeSize = size;
    this.keyframes.update(vehicle.keyframes, viewCorners(vehicle.calibration), size);
  }

  private updatePoints(vehicle: Vehicle): void {
    this.cloud?.update(document.documentElement.dataset.theme === "light");
    if (this.drawnWindow === vehicle.windowRevision) return;
    this.drawnWindow = vehicle.windowRevision;
    this.window.geometry.dispose();
    this.window.geometry = new BufferGeometry();
    this.window.geometry.setAttribute("position", new BufferAttribute(vehicle.windowPoints, 3));
  }

  private pressed(event: PointerEvent): void {
    if (!this.ruling || event.button !== 0) return;
    const box = this.canvas.getBoundingClientRect();
    const at = new Vector2(
      ((event.clientX - box.left) / box.width) * 2 - 1,
      1 - ((event.clientY - box.top) / box.height) * 2,
    );
    const point = this.pick(at);
    if (!point) return;
    if (this.rulerPoints.length === 2) this.rulerPoints.length = 0;
    this.rulerPoints.push(point);
    this.rulerLine.visible = this.rulerPoints.length === 2;
    this.rulerLabel.hidden = this.rulerPoints.length !== 2;
    if (this.rulerPoints.length === 2) {
      const [a, b] = this.rulerPoints as [Vector3, Vector3];
      this.rulerLine.geometry.setFromPoints([a, b]);
      const rise = b.z - a.z;
      this.rulerLabel.textContent = `${a.distanceTo(b).toFixed(2)} m  (Δz ${rise.toFixed(2)} m)`;
    }
    this.dirty = true;
  }

  /** The nearest point of map or window under the pointer, else the ground. */
  private pick(at: Vector2): Vector3 | undefined {
    const caster = new Raycaster();
    caster.setFromCamera(at, this.isPlan ? this.plan : this.eye);
    caster.params.Points = { threshold: this.metresPerPixel * 6 };
    const clouds = [this.window, ...(this.cloud ? [this.cloud.object] : [])].filter((c) => c.visible);
    const hits = caster.intersectObjects(clouds, false);
    const nearest = hits.sort((a, b) => (a.distanceToRay ?? 0) - (b.distanceToRay ?? 0))[0];
    if (nearest?.index !== undefined) {
      const positions = (nearest.object as Points).geometry.getAttribute("position");
      return new Vector3().fromBufferAttribute(positions as BufferAttribute, nearest.index);
    }
    // Seen from the side the ground is a line: there the plane through what is looked at is meant.
    const side = this.view === "side";
    const normal = side ? new Vector3(0, 1, 0) : new Vector3(0, 0, 1);
    const plane = new Plane(normal, side ? -this.planControls.target.y : 0);
    return caster.ray.intersectPlane(plane, new Vector3()) ?? undefined;
  }

  private placeRulerLabel(): void {
    if (this.rulerPoints.length !== 2) return;
    const [a, b] = this.rulerPoints as [Vector3, Vector3];
    const middle = a.clone().add(b).multiplyScalar(0.5);
    middle.project(this.isPlan ? this.plan : this.eye);
    this.rulerLabel.style.left = `${((middle.x + 1) / 2) * this.host.clientWidth}px`;
    this.rulerLabel.style.top = `${((1 - middle.y) / 2) * this.host.clientHeight}px`;
  }
}
