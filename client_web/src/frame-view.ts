// SPDX-License-Identifier: Apache-2.0
// Draws the stream's pictures on a canvas. Decodes off the main thread, skips a picture if a newer one is waiting,
// and reports each as done, so that the server knows how far behind this viewer is.
import { decodeFrameHeader, type FrameHeader } from './frame-header';
import { enlarged, type Size } from './image-size';

export class FrameView {
  private readonly context: CanvasRenderingContext2D;
  private next: { header: FrameHeader; message: ArrayBuffer } | undefined;
  private busy = false;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    /** Called once for each frame received: after it is drawn, or when it is skipped (`drawn` false). */
    private readonly onDone: (header: FrameHeader, drawn: boolean) => void,
    /** Size of the scene's picture; the smaller pictures sent while edits arrive are enlarged to it. */
    private readonly fullSize: () => Size | undefined = () => undefined,
  ) {
    this.context = canvas.getContext('2d', { alpha: false })!;
  }

  /** Takes one binary message. Throws if it is not a frame. */
  show(message: ArrayBuffer): void {
    const header = decodeFrameHeader(message);
    if (this.next) this.onDone(this.next.header, false);
    this.next = { header, message };
    if (!this.busy) void this.drawAll();
  }

  private async drawAll(): Promise<void> {
    this.busy = true;
    while (this.next) {
      const { header, message } = this.next;
      this.next = undefined;
      this.onDone(header, await this.draw(header, message));
    }
    this.busy = false;
  }

  private async draw(header: FrameHeader, message: ArrayBuffer): Promise<boolean> {
    try {
      const bytes = new Uint8Array(message, header.headerBytes);
      const picture = await createImageBitmap(new Blob([bytes], { type: header.mime }));
      const full = (header.interactive && this.fullSize()) || picture;
      // Setting the size clears the canvas: do it only when the size changes, just before drawing.
      if (this.canvas.width !== full.width || this.canvas.height !== full.height) {
        this.canvas.width = full.width;
        this.canvas.height = full.height;
      }
      const place = enlarged(picture, full);
      this.context.imageSmoothingQuality = 'high'; // cubic; the browser's default is linear
      this.context.drawImage(picture, place.x, place.y, place.width, place.height);
      picture.close();
      this.canvas.dataset.pictureWidth = String(header.width);
      this.canvas.dataset.revision = String(header.revision); // the scene on screen, for scripts and tests
      this.canvas.dataset.samples = String(header.samples);
      return true;
    } catch {
      return false; // a damaged picture is skipped: the next one replaces it
    }
  }
}
