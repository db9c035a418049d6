// SPDX-License-Identifier: Apache-2.0
import { expect, it } from 'vitest';
import { fitSize } from '../src/image-size';

it('a picture has the size of its place, shrunk in shape to what the server allows', () => {
  const place = { width: 2000, height: 1000 };
  expect(fitSize(place)).toEqual(place);
  expect(fitSize(place, { imageWidth: 1000 })).toEqual({ width: 1000, height: 500 });
  expect(fitSize(place, { imageHeight: 100 })).toEqual({ width: 200, height: 100 });
  expect(fitSize(place, { imagePixels: 500_000 })).toEqual({ width: 1000, height: 500 });
  expect(fitSize({ width: 0, height: 300 })).toEqual({ width: 1, height: 300 });
});
