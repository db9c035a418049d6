// SPDX-License-Identifier: Apache-2.0
import { afterEach, expect, it, vi } from 'vitest';
import { FrameView } from '../src/frame-view';

function message(frame: number): ArrayBuffer {
  const view = new DataView(new ArrayBuffer(49));
  view.setUint32(0, 0x584c4353, true);
  view.setUint16(4, 1, true);
  view.setUint16(6, 48, true);
  view.setUint8(8, 1);
  view.setUint32(16, frame, true);
  return view.buffer as ArrayBuffer;
}

afterEach(() => vi.unstubAllGlobals());

it('the newest picture wins, and every picture is reported once', async () => {
  const decodes: (() => void)[] = [];
  const decode = () => new Promise((resolve) => decodes.push(() => resolve({ width: 4, height: 3, close() {} })));
  vi.stubGlobal('createImageBitmap', decode);
  const drawImage = vi.fn();
  const canvas = { width: 1, height: 1, dataset: {}, getContext: () => ({ drawImage }) } as unknown as HTMLCanvasElement;
  const done: [number, boolean][] = [];
  const view = new FrameView(canvas, (header, drawn) => done.push([header.frame, drawn]));

  view.show(message(1));
  view.show(message(2)); // waits for the decoder
  view.show(message(3)); // replaces the one that waits
  expect(done).toEqual([[2, false]]);
  decodes.shift()!();
  await vi.waitFor(() => expect(decodes).toHaveLength(1));
  decodes.shift()!();
  await vi.waitFor(() => expect(done).toEqual([[2, false], [1, true], [3, true]]));
  expect(drawImage).toHaveBeenCalledTimes(2);
  expect([canvas.width, canvas.height]).toEqual([4, 3]);
});

it('a damaged picture is skipped and does not stop the next', async () => {
  vi.stubGlobal('createImageBitmap', vi.fn().mockRejectedValueOnce(new Error('damaged')).mockResolvedValue({ width: 1, height: 1, close() {} }));
  const canvas = { width: 1, height: 1, dataset: {}, getContext: () => ({ drawImage() {} }) } as unknown as HTMLCanvasElement;
  const done: [number, boolean][] = [];
  const view = new FrameView(canvas, (header, drawn) => done.push([header.frame, drawn]));
  view.show(message(1));
  await vi.waitFor(() => expect(done).toEqual([[1, false]]));
  view.show(message(2));
  await vi.waitFor(() => expect(done[1]).toEqual([2, true]));
});

it('a smaller picture of a scene that is edited is enlarged to the whole, about the centre', async () => {
  vi.stubGlobal('createImageBitmap', vi.fn().mockResolvedValue({ width: 134, height: 100, close() {} }));
  const drawImage = vi.fn();
  const context = { drawImage, imageSmoothingQuality: 'low' };
  const canvas = { width: 1, height: 1, dataset: {}, getContext: () => context } as unknown as HTMLCanvasElement;
  const view = new FrameView(canvas, () => {}, () => ({ width: 400, height: 300 }));
  const interactive = message(1);
  new DataView(interactive).setUint8(9, 1);
  view.show(interactive);
  await vi.waitFor(() => expect(drawImage).toHaveBeenCalled());
  expect([canvas.width, canvas.height]).toEqual([400, 300]);
  expect(drawImage.mock.calls[0]!.slice(1)).toEqual([-1, 0, 402, 300]);
  expect(context.imageSmoothingQuality).toBe('high');
});
