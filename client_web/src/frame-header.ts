// SPDX-License-Identifier: Apache-2.0
// The header before every picture on the stream; its layout is in protocol/PROTOCOL.md.

export const headerMagic = 0x584c4353; // "SCLX", little-endian
export const headerVersion = 1;
const minimumBytes = 48;

export interface FrameHeader {
  /** Offset of the image bytes: later versions may extend the header. */
  headerBytes: number;
  mime: 'image/jpeg' | 'image/png';
  /** Rendered at reduced cost because edits are arriving. */
  interactive: boolean;
  /** The stop condition is reached; no more frames until something changes. */
  final: boolean;
  width: number;
  height: number;
  /** The method used: 1 + its index in the capabilities' methods; 0 if unknown. */
  method: number;
  frame: number;
  revision: number;
  /** Newest patch of this client that the picture contains; 0 for none. */
  patch: number;
  samples: number;
  /** Estimated RMSE, linear premultiplied RGBA; NaN while unknown. */
  error: number;
  rebuildUs: number;
  renderUs: number;
  encodeUs: number;
}

const mimeOf: Record<number, FrameHeader['mime']> = { 1: 'image/jpeg', 2: 'image/png' };

/** Decodes the header of a binary message. Throws an Error that says what is wrong if it is not a valid frame. */
export function decodeFrameHeader(message: ArrayBuffer): FrameHeader {
  if (message.byteLength < minimumBytes)
    throw new Error(`frame of ${message.byteLength} bytes is shorter than its ${minimumBytes}-byte header`);
  const view = new DataView(message);
  const u16 = (at: number) => view.getUint16(at, true);
  const u32 = (at: number) => view.getUint32(at, true);
  if (u32(0) !== headerMagic) throw new Error('frame does not begin with "SCLX"');
  if (u16(4) !== headerVersion) throw new Error(`frame header version ${u16(4)}, expected ${headerVersion}`);
  const headerBytes = u16(6);
  if (headerBytes < minimumBytes || headerBytes > message.byteLength)
    throw new Error(`frame header says it is ${headerBytes} bytes long`);
  const mime = mimeOf[view.getUint8(8)];
  if (!mime) throw new Error(`frame codec ${view.getUint8(8)} is unknown`);
  const flags = view.getUint8(9);
  return {
    headerBytes,
    mime,
    interactive: (flags & 1) !== 0,
    final: (flags & 2) !== 0,
    width: u16(10),
    height: u16(12),
    method: view.getUint8(14),
    frame: u32(16),
    revision: u32(20),
    patch: u32(24),
    samples: u32(28),
    error: view.getFloat32(32, true),
    rebuildUs: u32(36),
    renderUs: u32(40),
    encodeUs: u32(44),
  };
}
