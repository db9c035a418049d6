// SPDX-License-Identifier: Apache-2.0
import { expect, it } from 'vitest';
import { fitSize, pictureSpot } from '../src/image-size';

it('a picture has the size of its place, shrunk in shape to what the server allows', () => {
  const place = { width: 2000, height: 1000 };
  expect(fitSize(place)).toEqual(place);
  expect(fitSize(place, { imageWidth: 1000 })).toEqual({ width: 1000, height: 500 });
  expect(fitSize(place, { imageHeight: 100 })).toEqual({ width: 200, height: 100 });
  expect(fitSize(place, { imagePixels: 500_000 })).toEqual({ width: 1000, height: 500 });
  expect(fitSize({ width: 0, height: 300 })).toEqual({ width: 1, height: 300 });
});

it('a spot on the page is a pixel of the picture in the middle of its box', () => {
  const box = { left: 10, top: 20, width: 400, height: 100 };
  const picture = { width: 200, height: 100 }; // 100 to the left and right of it
  expect(pictureSpot({ x: 110, y: 20 }, box, picture)).toEqual({ x: 0, y: 0 });
  expect(pictureSpot({ x: 309.5, y: 119 }, box, picture)).toEqual({ x: 199.5, y: 99 });
  expect(pictureSpot({ x: 109, y: 50 }, box, picture)).toBeUndefined();
  expect(pictureSpot({ x: 310, y: 50 }, box, picture)).toBeUndefined();
  expect(pictureSpot({ x: 200, y: 120 }, box, picture)).toBeUndefined();
  // Two device pixels per CSS pixel.
  expect(pictureSpot({ x: 10, y: 45 }, box, { width: 800, height: 200 })).toEqual({ x: 0, y: 50 });
});
