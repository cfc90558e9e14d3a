import {
  Box3,
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
import { FramePace } from "./rendering";
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

/** With many keyframes, their marks are made anew this often at most. */
const kKeyframesMs = 1000;
/** Shorter pieces of the trajectory would be drawn in vain [m]. */
const kLeastPiece = 0.01;
/** Where the processor draws, pieces are this long at least [px of the page]. */
const kPiecePixels = 4;
/** Dots of keyframes that lie nearer are left out where the processor draws [px of the page]. */
const kDotSpacing = 4;

/** The room that the vehicle moves in. */
export class SceneView {
  view: ViewName = "orbit";
  ruling = false;
  /** Where the vehicle is shown [s]. */
  timeShown: () => number = () => NaN;
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
  private readonly marker: CameraMarker;
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
  private drawnWindow = -1;
  private drawnPath: unknown;
  private drawnPlace = "";
  private drawnPicture: unknown;
  private drawnCalibration: unknown;
  private lastPoint = new Vector3();
  private lastSegment = -1;
  private lastState = -1;
  private leastPiece = kLeastPiece;
  private drawnPiece = kLeastPiece;
  private readonly mostPieces: number;
  private readonly travelled = new Box3();
  private readonly travelledBefore = new Box3();
  private touched = false;
  private dirty = true;
  private readonly followed = new Vector3();
  private readonly pace: FramePace;
  private readonly hidden = new Set<LayerName>();
  private readonly size = new Vector2(1, 1);

  constructor(
    private readonly host: HTMLElement,
    private readonly software: boolean,
  ) {
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: !software });
    this.pace = new FramePace();
    this.keyframes = new KeyframeMarkers(software ? 150 : 1500);
    this.marker = new CameraMarker(software ? 160 : 1280);
    this.mostPieces = software ? 20_000 : 240_000;
    host.prepend(this.canvas);
    host.append(this.rulerLabel);
    this.rulerLabel.hidden = true;
    this.window = new Points(
      new BufferGeometry(),
      new PointsMaterial({ size: 3, sizeAttenuation: false }),
    );
    this.window.frustumCulled = false;
    // The map has most of these points too: those of the window are seen.
    this.window.renderOrder = 1;
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
    this.cloud?.dispose();
    this.vehicle = vehicle;
    this.cloud = vehicle ? new MapCloud(vehicle.map, this.software ? 2 : 1.5) : undefined;
    if (this.cloud) this.scene.add(this.cloud.object);
    this.showLayers();
    this.leastPiece = kLeastPiece;
    this.drawnRevision = -1;
    this.drawnKeyframes = -1;
    this.drawnWindow = -1;
    this.drawnPath = this.drawnPlace = this.drawnPicture = "none";
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
    if (on) this.hidden.delete(layer);
    else this.hidden.add(layer);
    this.showLayers();
  }

  get framesPerSecond(): number {
    return this.pace.framesPerSecond;
  }

  /** What is left out for want of a fast graphics card; empty: nothing. */
  get detailText(): string {
    if (this.software) return "no graphics card: less detail";
    return this.pace.isCoarse && window.devicePixelRatio > 1 ? "slow graphics: fewer pixels" : "";
  }

  get gridText(): string {
    return `grid ${Number(this.grid.step.toPrecision(1))} m, at z = 0 of odom`;
  }

  /** Metres that one pixel of the page spans at the place looked at. */
  get metresPerPixel(): number {
    const height = this.size.y;
    if (this.isPlan) return (this.plan.top - this.plan.bottom) / this.plan.zoom / height;
    const distance = this.eye.position.distanceTo(this.controls.target);
    return (2 * distance * Math.tan((this.eye.fov * Math.PI) / 360)) / height;
  }

  setView(view: ViewName): void {
    const target = this.activeControls.target.clone();
    const span = this.metresPerPixel * this.size.y;
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
    const all = new Box3(new Vector3(-1, -1, -0.5), new Vector3(1, 1, 0.5));
    const { min: low, max: high } = all.union(this.travelled).union(this.travelledBefore);
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
    this.drawnPath = this.drawnPlace = "none";
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

  /** Brings the objects up to date; what changed wants to be drawn. */
  private update(): void {
    this.updateOther();
    const vehicle = this.vehicle;
    if (!vehicle) return;
    const moved = this.updateTrajectory(vehicle);
    const movedBefore = this.updatePath(vehicle);
    this.updateMarker(vehicle, this.timeShown());
    this.updateKeyframes(vehicle);
    this.updatePoints(vehicle);
    if ((moved || movedBefore) && !this.touched && this.view !== "follow") this.fit();
  }

  private showLayers(): void {
    const shows = (layer: LayerName) => !this.hidden.has(layer);
    this.line.object.visible = shows("trajectory") && this.line.length > 0;
    if (this.cloud) this.cloud.object.visible = shows("map");
    this.window.visible = shows("points");
    this.keyframes.object.visible = shows("keyframes");
    this.grid.object.visible = shows("grid");
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
    const aspect = this.size.x / this.size.y;
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
    this.size.set(w, h);
    this.renderer.setSize(w, h, false);
    this.eye.aspect = w / h;
    this.eye.updateProjectionMatrix();
    this.setPlanSpan(this.plan.top - this.plan.bottom);
    for (const line of [this.line, this.pathLine, this.otherLine]) line.setResolution(this.size);
    this.dirty = true;
  }

  private tick(now: number): void {
    requestAnimationFrame((t) => this.tick(t));
    if (!this.pace.tick(now)) return;
    this.update();
    if (!this.dirty) return;
    this.draw();
    this.pace.drew(now);
  }

  private draw(): void {
    this.dirty = false;
    this.applyDetail();
    const controls = this.activeControls;
    const distance = this.metresPerPixel * this.size.y;
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

  private applyDetail(): void {
    const most = this.software || this.pace.isCoarse ? 1 : 2;
    const pixels = Math.min(window.devicePixelRatio, most);
    if (pixels !== this.renderer.getPixelRatio()) this.renderer.setPixelRatio(pixels);
  }

  /** Returns whether there is more of it. */
  private updateTrajectory(vehicle: Vehicle): boolean {
    const poses = vehicle.poses;
    const pixels = this.software ? kPiecePixels * this.metresPerPixel : 0;
    const piece = Math.max(this.leastPiece, pixels);
    const resized = piece > 2 * this.drawnPiece || piece < 0.5 * this.drawnPiece;
    if (this.drawnRevision !== poses.revision || resized) {
      this.drawnPiece = piece;
      this.line.clear();
      this.travelled.makeEmpty();
      this.drawnRevision = poses.revision;
      this.drawnPoses = 0;
      this.lastSegment = -1;
      this.dirty = true;
    }
    if (this.drawnPoses === poses.length) return false;
    const colors = this.stateColors;
    for (; this.drawnPoses < poses.length; ++this.drawnPoses) {
      const i = this.drawnPoses;
      const p = new Vector3(poses.x(i), poses.y(i), poses.z(i));
      this.travelled.expandByPoint(p);
      const segment = poses.segment(i);
      const state = poses.state(i);
      if (segment !== this.lastSegment) {
        this.lastSegment = segment;
        this.lastState = state;
        this.lastPoint.copy(p);
        continue;
      }
      const least = state === this.lastState ? this.drawnPiece : kLeastPiece;
      if (p.distanceTo(this.lastPoint) < least) continue;
      const a = this.lastPoint;
      this.line.push(a.x, a.y, a.z, p.x, p.y, p.z, colors[state] ?? colors[6]!);
      this.lastState = state;
      this.lastPoint.copy(p);
    }
    this.line.flush();
    this.showLayers();
    if (this.line.length > this.mostPieces) {
      this.leastPiece *= 2;
      this.drawnRevision = -1;
    }
    return true;
  }

  /** What was travelled before this page was opened. Returns whether there is news of it. */
  private updatePath(vehicle: Vehicle): boolean {
    if (this.drawnPath === vehicle.path) return false;
    this.drawnPath = vehicle.path;
    const poses = vehicle.path?.poses.map((p) => p.pose) ?? [];
    this.travelledBefore.setFromPoints(poses.map((p) => p.position as Vector3));
    this.drawPoses(this.pathLine, poses, new Color(themeColor("--faint")));
    return true;
  }

  private updateOther(): void {
    if (this.drawnOther === this.otherRevision) return;
    this.drawnOther = this.otherRevision;
    this.drawPoses(this.otherLine, this.other, new Color(themeColor("--blue")));
  }

  private drawPoses(line: GrowingLine, poses: Pose[], color: Color): void {
    line.clear();
    const step = Math.max(1, Math.ceil(poses.length / this.mostPieces));
    for (let i = 0; i + 1 < poses.length; i += step) {
      const [a, b] = [poses[i]!.position, poses[Math.min(i + step, poses.length - 1)]!.position];
      line.push(a.x, a.y, a.z, b.x, b.y, b.z, color);
    }
    line.flush();
    this.dirty = true;
  }

  private updateMarker(vehicle: Vehicle, time: number): void {
    if (this.drawnCalibration !== vehicle.calibration) {
      this.drawnCalibration = vehicle.calibration;
      this.marker.setCalibration(vehicle.calibration);
      this.drawnKeyframes = -1;
      this.dirty = true;
    }
    this.updatePicture(vehicle, time);
    const i = vehicle.poses.at(time);
    const place = `${i < 0 ? "" : vehicle.poses.time(i)} ${this.view}`;
    if (this.drawnPlace === place) return;
    this.drawnPlace = place;
    this.dirty = true;
    this.marker.object.visible = this.plumb.visible = i >= 0;
    if (i < 0) return;
    const [x, y, z] = [vehicle.poses.x(i), vehicle.poses.y(i), vehicle.poses.z(i)];
    const [qx, qy, qz, qw] = vehicle.poses.orientation(i);
    placeAt(this.marker.object, {
      position: { x, y, z },
      orientation: { x: qx, y: qy, z: qz, w: qw },
    });
    this.marker.setColor(this.stateColors[vehicle.poses.state(i)] ?? this.stateColors[6]!);
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

  private updatePicture(vehicle: Vehicle, time: number): void {
    const bitmap = this.hidden.has("picture") ? undefined : vehicle.left.at(time)?.bitmap;
    if (this.drawnPicture === bitmap) return;
    this.drawnPicture = bitmap;
    this.marker.setPicture(bitmap);
    this.dirty = true;
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
    const spacing = this.software ? kDotSpacing * this.metresPerPixel : 0;
    this.keyframes.update(vehicle.keyframes, viewCorners(vehicle.calibration), size, spacing);
    this.dirty = true;
  }

  private updatePoints(vehicle: Vehicle): void {
    const light = document.documentElement.dataset.theme === "light";
    if (this.cloud?.update(light)) this.dirty = true;
    if (this.drawnWindow === vehicle.windowRevision) return;
    this.drawnWindow = vehicle.windowRevision;
    this.window.geometry.dispose();
    this.window.geometry = new BufferGeometry();
    this.window.geometry.setAttribute("position", new BufferAttribute(vehicle.windowPoints, 3));
    this.dirty = true;
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
    this.rulerLabel.style.left = `${((middle.x + 1) / 2) * this.size.x}px`;
    this.rulerLabel.style.top = `${((1 - middle.y) / 2) * this.size.y}px`;
  }
}
