// SPDX-License-Identifier: Apache-2.0
// The size to ask pictures in: that of their place on the page, within the server's limits; and where a smaller one goes.

export interface Size {
  width: number;
  height: number;
}

/** Whole pixels of the same shape, at least one; `limits` are those of the capabilities. */
export function fitSize({ width, height }: Size, limits: Readonly<Record<string, number>> = {}): Size {
  const { imageWidth = Infinity, imageHeight = Infinity, imagePixels = Infinity } = limits;
  const shrink = Math.min(1, imageWidth / width, imageHeight / height, Math.sqrt(imagePixels / (width * height)));
  const whole = (length: number) => Math.max(1, Math.floor(length * shrink));
  return { width: whole(width), height: whole(height) };
}

/** Where a smaller picture of the same view belongs in the full one: they share centre and vertical angle. */
export function enlarged(picture: Size, full: Size): Size & { x: number; y: number } {
  const width = (picture.width * full.height) / picture.height;
  return { x: (full.width - width) / 2, y: 0, width, height: full.height };
}
