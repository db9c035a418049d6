// SPDX-License-Identifier: Apache-2.0
// Camera movements as pure functions: a turntable around the target, which keeps the horizon level.
import type { JsonObject } from './merge-patch';

export type Vector = readonly [number, number, number];

export interface Camera {
  eye: Vector;
  target: Vector;
  up: Vector;
  /** Degrees; present for a perspective camera. */
  fovY?: number;
  /** Full height of the view in world units; present for an orthographic camera. */
  orthoHeight?: number;
}

const add = (a: Vector, b: Vector): Vector => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const subtract = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a: Vector, s: number): Vector => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a: Vector, b: Vector) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: Vector, b: Vector): Vector => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const normalize = (a: Vector): Vector => scale(a, 1 / Math.hypot(...a));

/** Rodrigues' rotation of v by `angle` radians about the unit axis. */
function rotate(v: Vector, axis: Vector, angle: number): Vector {
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  return add(add(scale(v, c), scale(cross(axis, v), s)), scale(axis, dot(axis, v) * (1 - c)));
}

/**
 * Unit vectors to the right and upward in the picture, and the eye's offset from the target. If up is parallel to the
 * line of sight, right is any vector perpendicular to it.
 */
function frame(camera: Camera): { right: Vector; upward: Vector; offset: Vector } {
  const offset = subtract(camera.eye, camera.target);
  let right = cross(camera.up, offset);
  if (Math.hypot(...right) < 1e-9 * Math.hypot(...camera.up) * Math.hypot(...offset)) {
    const other: Vector = Math.abs(offset[0]) < Math.abs(offset[1]) ? [1, 0, 0] : [0, 1, 0];
    right = cross(other, offset);
  }
  right = normalize(right);
  return { right, upward: normalize(cross(offset, right)), offset };
}

export const distanceOf = (camera: Camera) => Math.hypot(...subtract(camera.eye, camera.target));
export const isOrthographic = (camera: Camera) => camera.orthoHeight !== undefined;

/** Height of the view at the target, world units. */
export function viewHeight(camera: Camera): number {
  if (camera.orthoHeight !== undefined) return camera.orthoHeight;
  return 2 * distanceOf(camera) * Math.tan(((camera.fovY ?? 35) * Math.PI) / 360);
}

const kPole = 0.01; // minimum angle between the line of sight and up, radians

/** Rotates by `yaw` about up and by `pitch` about right, radians; positive values move the object right and down. */
export function orbit(camera: Camera, yaw: number, pitch: number): Camera {
  const up = normalize(camera.up);
  const { right, offset } = frame(camera);
  const polar = Math.acos(Math.max(-1, Math.min(1, dot(normalize(offset), up))));
  const wanted = Math.max(kPole, Math.min(Math.PI - kPole, polar - pitch));
  const tilted = rotate(offset, right, wanted - polar);
  return { ...camera, eye: add(camera.target, rotate(tilted, up, -yaw)) };
}

/** Moves the picture's content by (right, down), as fractions of the picture's height. */
export function pan(camera: Camera, right: number, down: number): Camera {
  const axes = frame(camera);
  const height = viewHeight(camera);
  const move = add(scale(axes.right, -right * height), scale(axes.upward, down * height));
  return { ...camera, eye: add(camera.eye, move), target: add(camera.target, move) };
}

/**
 * Makes the object `factor` times as large. The eye's distance (orthographic: the view's height) stays within 1e-3 to
 * 1e2 times `size`, the volume's diagonal.
 */
export function zoom(camera: Camera, factor: number, size: number): Camera {
  const bound = (length: number) => Math.max(1e-3 * size, Math.min(1e2 * size, length));
  if (camera.orthoHeight !== undefined) return { ...camera, orthoHeight: bound(camera.orthoHeight / factor) };
  const offset = subtract(camera.eye, camera.target);
  const distance = Math.hypot(...offset);
  return { ...camera, eye: add(camera.target, scale(offset, bound(distance / factor) / distance)) };
}

/** The same view with parallel rays. The eye moves out to at least `size`, as orthographic rays start in its plane. */
export function toOrthographic(camera: Camera, size: number): Camera {
  const offset = subtract(camera.eye, camera.target);
  const distance = Math.hypot(...offset);
  const eye = add(camera.target, scale(offset, Math.max(distance, size) / distance));
  return { eye, target: camera.target, up: camera.up, orthoHeight: viewHeight(camera) };
}

/** The same view height at the target, in perspective. */
export function toPerspective(camera: Camera, fovY: number): Camera {
  const distance = viewHeight(camera) / (2 * Math.tan((fovY * Math.PI) / 360));
  const offset = normalize(subtract(camera.eye, camera.target));
  return { eye: add(camera.target, scale(offset, distance)), target: camera.target, up: camera.up, fovY };
}

/** The patch that moves the camera from `before` to `camera`. */
export function cameraPatch(camera: Camera, before: Camera | undefined): JsonObject {
  const { eye, target, up, orthoHeight, fovY } = camera;
  const view: JsonObject = { eye: [...eye], target: [...target], up: [...up] };
  // Setting either one removes the other, so fovY is sent only when the projection changes.
  if (orthoHeight !== undefined) view.orthoHeight = orthoHeight;
  else if (before?.orthoHeight !== undefined && fovY !== undefined) view.fovY = fovY;
  return view;
}
