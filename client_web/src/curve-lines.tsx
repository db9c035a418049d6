// SPDX-License-Identifier: Apache-2.0
// Lines across the plot of a curve, one for every isovalue: at the position of its value, and as high as its opacity.
// Their handles can be dragged, or moved by the arrow keys.
import type { RefObject } from 'preact';
import { useRef } from 'preact/hooks';
import { fractionIn, followPointer } from './drag';
import { clamp, kSteps, stepSize, type Point } from './curve';

export interface CurveLine {
  /** Position and opacity, both in [0, 1]. */
  at: Point;
  /** CSS colour. */
  color: string;
  /** A description of the line, such as "isovalue 120, opacity 0.5". */
  text: string;
}

interface Props {
  plot: RefObject<HTMLElement>;
  lines: readonly CurveLine[];
  onMove(index: number, to: Point): void;
}

export function CurveLines({ plot, lines, onMove }: Props) {
  const latest = useRef(onMove); // a drag outlives the render it began in
  latest.current = onMove;
  const move = (index: number, x: number, y: number) => latest.current(index, [clamp(x), clamp(y)]);
  const onKey = (event: KeyboardEvent, index: number, at: Point) => {
    const step = kSteps[event.key];
    if (!step) return;
    const size = stepSize(event);
    move(index, at[0] + step[0] * size, at[1] + step[1] * size);
    event.preventDefault();
  };
  return (
    <>
      {lines.map(({ at, color, text }, index) => (
        // The index is that of the item in the scene: lines outside the plot are not drawn, but counted.
        at[0] >= 0 && at[0] <= 1 && (
          <div key={index} class="curve-mark" style={{ left: `${at[0] * 100}%`, height: `${at[1] * 100}%`, background: color }}>
            <div
              class="mark-handle"
              role="slider"
              tabIndex={0}
              aria-label={`Isovalue ${index + 1}`}
              aria-orientation="horizontal"
              aria-valuemin={0}
              aria-valuemax={1}
              aria-valuenow={at[0]}
              aria-valuetext={text}
              title={text}
              style={{ background: color }}
              onPointerDown={(event) => {
                event.stopPropagation();
                followPointer(event, (next) => {
                  const to = fractionIn(plot.current!, next);
                  move(index, to.x, to.y);
                });
              }}
              onDblClick={(event) => event.stopPropagation()}
              onKeyDown={(event) => onKey(event, index, at)}
            />
          </div>
        )
      ))}
    </>
  );
}
