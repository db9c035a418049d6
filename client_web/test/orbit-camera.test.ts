// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from 'vitest';
import {
  distanceOf,
  orbit,
  pan,
  toOrthographic,
  toPerspective,
  viewHeight,
  zoom,
  type Camera,
  type Vector,
} from '../src/orbit-camera';

const front: Camera = { eye: [0, 0, 10], target: [0, 0, 0], up: [0, 1, 0], fovY: 90 };

function expectVector(found: Vector, wanted: Vector): void {
  found.forEach((value, axis) => expect(value).toBeCloseTo(wanted[axis]!, 9));
}

describe('orbiting', () => {
  it('to the right turns the camera to the left about up', () => {
    expectVector(orbit(front, Math.PI / 2, 0).eye, [-10, 0, 0]);
  });
  it('down lifts the camera', () => {
    expectVector(orbit(front, 0, Math.PI / 6).eye, [0, 5, 10 * Math.cos(Math.PI / 6)]);
  });
  it('stops short of the poles, and comes back from them', () => {
    const top = orbit(front, 0, 10);
    expect(top.eye[1]).toBeGreaterThan(9.99);
    expect(top.eye[2]).toBeGreaterThan(0);
    expect(orbit(top, 0, -10).eye[1]).toBeLessThan(-9.99);
  });
  it('keeps distance, target and up', () => {
    const away: Camera = { eye: [1e6 + 3, 4, 5], target: [1e6, 1, 2], up: [0, 0, 1], fovY: 35 };
    const moved = orbit(orbit(away, 0.3, -0.2), 1, 0.5);
    expect(distanceOf(moved)).toBeCloseTo(distanceOf(away), 6);
    expect(moved.target).toEqual(away.target);
    expect(moved.up).toEqual(away.up);
  });
  it('works when the camera looks along up', () => {
    const above: Camera = { eye: [0, 10, 0], target: [0, 0, 0], up: [0, 1, 0], fovY: 35 };
    orbit(above, 0.1, -0.1).eye.forEach((value) => expect(value).not.toBeNaN());
  });
});

describe('shifting', () => {
  it('moves the content with the pointer: at 90 degrees the picture is twice the distance high', () => {
    const moved = pan(front, 0.5, 0.25);
    expectVector(moved.eye, [-10, 5, 10]);
    expectVector(moved.target, [-10, 5, 0]);
  });
  it('of parallel rays follows their height, not the distance', () => {
    expectVector(pan({ ...front, fovY: undefined, orthoHeight: 4 }, 1, 0).target, [-4, 0, 0]);
  });
});

describe('zooming', () => {
  it('by two halves the distance, or the height of parallel rays', () => {
    expectVector(zoom(front, 2, 10).eye, [0, 0, 5]);
    const flat = zoom({ ...front, fovY: undefined, orthoHeight: 4 }, 2, 10);
    expect(flat.orthoHeight).toBe(2);
    expect(flat.eye).toEqual(front.eye);
  });
  it('never reaches the target', () => {
    expect(distanceOf(zoom(front, 1e30, 10))).toBeCloseTo(0.01, 12);
  });
});

describe('changing the projection', () => {
  it('keeps the size at the target, there and back', () => {
    const flat = toOrthographic(front, 50);
    expect(flat.fovY).toBeUndefined();
    expect(flat.orthoHeight).toBeCloseTo(20, 9);
    expect(distanceOf(flat)).toBeCloseTo(50, 9);
    const back = toPerspective(flat, 90);
    expect(back.orthoHeight).toBeUndefined();
    expect(viewHeight(back)).toBeCloseTo(20, 9);
    expectVector(back.eye, front.eye);
  });
});
