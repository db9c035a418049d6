// SPDX-License-Identifier: Apache-2.0
// The live picture: a canvas whose gestures move the camera.
import { useEffect, useRef } from 'preact/hooks';
import { FrameView } from './frame-view';
import { attachGestures } from './gestures';
import { orbitControls } from './orbit-controls';
import { attachPointerPick } from './pointer-pick';
import type { Store } from './store';

/** More than two device pixels per CSS pixel would cost rays without a visible benefit. */
const kMostPixelRatio = 2;
const kResizeRestMs = 120;

export function PictureView({ store, attach }: { store: Store; attach(view: FrameView): void }) {
  const box = useRef<HTMLDivElement>(null);
  const canvas = useRef<HTMLCanvasElement>(null);

  useEffect(() => {
    const element = box.current!;
    const fullSize = () => store.imageSize;
    attach(new FrameView(canvas.current!, (header, drawn) => store.frameDone(header, drawn), fullSize));
    let timer: ReturnType<typeof setTimeout> | undefined;
    const measure = () => {
      const ratio = Math.min(kMostPixelRatio, window.devicePixelRatio || 1);
      const { clientWidth, clientHeight } = element;
      store.setImageSize({ width: Math.round(clientWidth * ratio), height: Math.round(clientHeight * ratio) });
    };
    const observer = new ResizeObserver(() => {
      clearTimeout(timer);
      timer = setTimeout(measure, kResizeRestMs);
    });
    measure();
    observer.observe(element);
    const showHide = () => store.setVisible(document.visibilityState === 'visible');
    document.addEventListener('visibilitychange', showHide);
    const detach = [attachGestures(element, orbitControls(store)), attachPointerPick(element, store.pick, fullSize)];
    return () => {
      for (const one of detach) one();
      clearTimeout(timer);
      observer.disconnect();
      document.removeEventListener('visibilitychange', showHide);
    };
  }, [store]);

  return (
    <div
      ref={box}
      class="picture"
      tabIndex={0}
      role="application"
      aria-roledescription="volume view"
      aria-label="Volume. Arrow keys rotate, Shift and arrow keys pan, plus and minus zoom, R resets the view."
      style={{ background: store.scene.value?.image?.background ?? '#000' }}
    >
      <canvas ref={canvas} width={1} height={1} />
      {!store.frame.value && !store.choice.loading.value && store.connection.value.kind !== 'choosing' && (
        <p class="picture-wait">Waiting for the first picture …</p>
      )}
    </div>
  );
}
