// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from 'node:fs';
import { describe, expect, it } from 'vitest';
import { decodeFrameHeader } from '../src/frame-header';

/** The specification's byte layout, written out by hand. */
function headerBytes(): Uint8Array {
  return Uint8Array.from([
    0x53, 0x43, 0x4c, 0x58, 1, 0, 48, 0, // "SCLX", version, header bytes
    2, 3, 0x80, 0x07, 0x38, 0x04, 6, 0, // PNG, interactive + final, 1920 x 1080, sixth method
    7, 0, 0, 0, 9, 0, 0, 0, // frame, revision
    0xff, 0xff, 0xff, 0xff, 0, 1, 0, 0, // patch 2^32 - 1, samples 256
    0, 0, 0x80, 0x3e, 1, 0, 0, 0, // error 0.25, rebuild
    2, 0, 0, 0, 3, 0, 0, 0, // render, encode
  ]);
}

interface Fixture {
  name: string;
  hex: string;
  header: (Record<string, number> & { error: number | null }) | null;
}
const fixtures = JSON.parse(
  readFileSync(new URL('../../protocol/fixtures/frame_headers.json', import.meta.url), 'utf8'),
) as Fixture[];
const bytesOf = (hex: string) => Uint8Array.from(hex.match(/../g) ?? [], (pair) => parseInt(pair, 16)).buffer as ArrayBuffer;

describe('the frame headers that both languages check', () => {
  it('are all of them', () => expect(fixtures.length).toBeGreaterThan(5));

  it.each(fixtures)('$name', ({ hex, header }) => {
    if (!header) {
      expect(() => decodeFrameHeader(bytesOf(hex))).toThrow();
      return;
    }
    const { codec, flags, error, ...fields } = header;
    expect(decodeFrameHeader(bytesOf(hex))).toEqual({
      ...fields,
      mime: codec === 1 ? 'image/jpeg' : 'image/png',
      interactive: (flags! & 1) !== 0,
      final: (flags! & 2) !== 0,
      error: error ?? NaN,
    });
  });
});

describe('the frame header', () => {
  it('is read as the specification lays it out', () => {
    expect(decodeFrameHeader(headerBytes().buffer as ArrayBuffer)).toEqual({
      headerBytes: 48,
      mime: 'image/png',
      interactive: true,
      final: true,
      width: 1920,
      height: 1080,
      method: 6,
      frame: 7,
      revision: 9,
      patch: 4294967295,
      samples: 256,
      error: 0.25,
      rebuildUs: 1,
      renderUs: 2,
      encodeUs: 3,
    });
  });

  it.each([
    ['another magic', 0, 0x54, /SCLX/],
    ['a later version', 4, 2, /version 2/],
    ['a header longer than the message', 6, 49, /49 bytes/],
    ['a header shorter than its fields', 6, 40, /40 bytes/],
    ['an unknown codec', 8, 9, /codec 9/],
  ])('is refused with %s', (_, at, value, words) => {
    const bytes = headerBytes();
    bytes[at] = value;
    expect(() => decodeFrameHeader(bytes.buffer as ArrayBuffer)).toThrow(words);
  });

  it('is refused when cut short', () => {
    expect(() => decodeFrameHeader(headerBytes().slice(0, 47).buffer as ArrayBuffer)).toThrow(/47 bytes/);
  });
});
