// SPDX-License-Identifier: Apache-2.0
// The size of the picture to request: that of its area on the page, within the server's limits. Also the mapping of
// points on the page and of smaller pictures into it.

export interface Size {
  width: number;
  height: number;
}

export interface Spot {
  x: number;
  y: number;
}

/** The size, shrunk in proportion to `limits` (of the capabilities) if needed; in whole pixels, at least 1 x 1. */
export function fitSize({ width, height }: Size, limits: Readonly<Record<string, number>> = {}): Size {
  const { imageWidth = Infinity, imageHeight = Infinity, imagePixels = Infinity } = limits;
  const shrink = Math.min(1, imageWidth / width, imageHeight / height, Math.sqrt(imagePixels / (width * height)));
  const whole = (length: number) => Math.max(1, Math.floor(length * shrink));
  return { width: whole(width), height: whole(height) };
}

/**
 * Converts a position on the page to pixels from the picture's top left corner; undefined outside the picture. The
 * picture is centred in the box, as large as its aspect ratio allows.
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

/** Where to draw a smaller picture of the same view in the full one: both have the same centre and vertical angle. */
export function enlarged(picture: Size, full: Size): Size & { x: number; y: number } {
  const width = (picture.width * full.height) / picture.height;
  return { x: (full.width - width) / 2, y: 0, width, height: full.height };
}
