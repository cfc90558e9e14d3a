// The messages that the page reads, as the schemas of the server describe them.

export interface Time {
  sec: number;
  nanosec: number;
}
export interface Header {
  stamp: Time;
  frame_id: string;
}
export interface Vector3 {
  x: number;
  y: number;
  z: number;
}
export interface Quaternion extends Vector3 {
  w: number;
}
export interface Pose {
  position: Vector3;
  orientation: Quaternion;
}
export interface ScaledOdometry {
  header: Header;
  pose: { pose: Pose };
  twist: { twist: { linear: Vector3; angular: Vector3 } };
  state: number;
  segment: number;
  keyframe_id: number;
  is_keyframe: boolean;
  scale_valid: boolean;
  log_scale: number;
  log_scale_sigma: number;
  last_correction: number;
  scale_residual: number;
  scale_age_s: number;
  scale_verdict: number;
}
export interface VoStatus {
  header: Header;
  state: number;
  reason: string;
  received: bigint;
  lost_transport: bigint;
  dropped_queue: bigint;
  rejected: bigint;
  last_command_id: bigint;
  last_command_result: string;
  reset_counter: number;
  segment: number;
  points: number;
  inliers: number;
  keyframes: number;
  queue_depth: number;
  sync_error_s: number;
  residual: number;
  latency_s: number;
  distance_m: number;
  stages: { name: string; last_ms: number; mean_ms: number; max_ms: number }[];
}
export interface Keyframe {
  header: Header;
  id: number;
  segment: number;
  pose: Pose;
  log_scale: number;
}
export interface CompressedImage {
  header: Header;
  format: string;
  data: Uint8Array;
}
export interface TrackedPoints {
  header: Header;
  u: Float32Array;
  v: Float32Array;
  inverse_depth: Float32Array;
}
export interface PointCloud2 {
  header: Header;
  width: number;
  height: number;
  fields: { name: string; offset: number; datatype: number }[];
  point_step: number;
  data: Uint8Array;
}
export interface CameraModel {
  width: number;
  height: number;
  fx_fy_cx_cy: ArrayLike<number>;
}
export interface StereoCalibration {
  left: CameraModel;
  right: CameraModel;
  base_from_left: { translation: Vector3; rotation: Quaternion };
}
export interface Path {
  header: Header;
  poses: { header: Header; pose: Pose }[];
}
export interface Odometry {
  header: Header;
  pose: { pose: Pose };
}
export interface DiagnosticArray {
  header: Header;
  status: {
    level: number;
    name: string;
    message: string;
    hardware_id: string;
    values: { key: string; value: string }[];
  }[];
}
export interface RecorderStatus {
  recording: boolean;
  file: string;
  reason: string;
  last_command_id: bigint;
  bytes: bigint;
  free_bytes: bigint;
  dropped: bigint;
}

/** Seconds, UTC. */
export function seconds(time: Time): number {
  return time.sec + time.nanosec * 1e-9;
}
