// SPDX-License-Identifier: Apache-2.0
// The size to ask pictures in: that of their place on the page, within the server's limits; and where a smaller one goes.

export interface Size {
  width: number;
  height: number;
}

export interface Spot {
  x: number;
  y: number;
}

/** Whole pixels of the same shape, at least one; `limits` are those of the capabilities. */
export function fitSize({ width, height }: Size, limits: Readonly<Record<string, number>> = {}): Size {
  const { imageWidth = Infinity, imageHeight = Infinity, imagePixels = Infinity } = limits;
  const shrink = Math.min(1, imageWidth / width, imageHeight / height, Math.sqrt(imagePixels / (width * height)));
  const whole = (length: number) => Math.max(1, Math.floor(length * shrink));
  return { width: whole(width), height: whole(height) };
}

/**
 * Pixels from the picture's top left corner of a spot on the page, when the picture fills the box as far as its
 * shape allows, in the middle; undefined beside it.
 */
export function pictureSpot(
  spot: Spot,
  box: { left: number; top: number; width: number; height: number },
  picture: Size,
): Spot | undefined {
  const scale = Math.min(box.width / picture.width, box.height / picture.height);
  const x = (spot.x - box.left - box.width / 2) / scale + picture.width / 2;
  const y = (spot.y - box.top - box.height / 2) / scale + picture.height / 2;
  return x >= 0 && x < picture.width && y >= 0 && y < picture.height ? { x, y } : undefined;
}

/** Where a smaller picture of the same view belongs in the full one: they share centre and vertical angle. */
export function enlarged(picture: Size, full: Size): Size & { x: number; y: number } {
  const width = (picture.width * full.height) / picture.height;
  return { x: (full.width - width) / 2, y: 0, width, height: full.height };
}
