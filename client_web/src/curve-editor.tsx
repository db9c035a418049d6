// SPDX-License-Identifier: Apache-2.0
// Editor of a curve, such as opacity, drawn over the histogram within the range. Points are moved by dragging or
// the arrow keys, added by a double click, Enter or Insert, and removed by a double click, Delete or Backspace.
import { useLayoutEffect, useRef } from 'preact/hooks';
import { addPoint, evaluate, kSteps, movePoint, pointAfter, removePoint, stepSize, type Curve, type Point } from './curve';
import { CurveLines, type CurveLine } from './curve-lines';
import { fractionIn, followPointer } from './drag';
import { histogramPath, type Histogram } from './histogram';
import { shortNumber } from './controls';

interface Props {
  /** The name of the curve's values, such as "Opacity". */
  label: string;
  curve: Curve;
  range: readonly [number, number];
  histogram: Histogram | undefined;
  /** CSS background that shows the channel's colours from left to right. */
  paint: string;
  onChange(curve: Curve): void;
  lines?: readonly CurveLine[];
  onMoveLine?(index: number, to: Point): void;
}

export function CurveEditor({ label, curve, range, histogram, paint, onChange, lines = [], onMoveLine }: Props) {
  const plot = useRef<HTMLDivElement>(null);
  const handles = useRef<(HTMLDivElement | null)[]>([]);
  const focusNext = useRef<number | undefined>(undefined);
  const latest = useRef(curve); // a drag outlives the render it began in
  latest.current = curve;
  const change = (next: Curve) => {
    latest.current = next;
    onChange(next);
  };

  // Before the next key arrives, which is meant for that point.
  useLayoutEffect(() => {
    if (focusNext.current === undefined) return;
    handles.current[focusNext.current]?.focus();
    focusNext.current = undefined;
  });

  const onKey = (event: KeyboardEvent, index: number) => {
    const step = kSteps[event.key];
    const point = curve[index];
    if (!point) return;
    if (step) {
      const size = stepSize(event);
      change(movePoint(curve, index, [point[0] + step[0] * size, point[1] + step[1] * size]));
    } else if (event.key === 'Delete' || event.key === 'Backspace') {
      focusNext.current = Math.max(0, index - 1);
      change(removePoint(curve, index));
    } else if (event.key === 'Enter' || event.key === 'Insert') {
      const added = addPoint(curve, pointAfter(curve, index));
      focusNext.current = added.index;
      change(added.curve);
    } else {
      return;
    }
    event.preventDefault();
  };

  const onDoubleClick = (event: MouseEvent) => {
    const { x } = fractionIn(plot.current!, event);
    const added = addPoint(curve, [x, evaluate(curve, x)]);
    focusNext.current = added.index;
    change(added.curve);
  };

  const ends = [evaluate(curve, 0), curve[curve.length - 1]?.[1] ?? 0] as const;
  const corners = [[0, ends[0]] as const, ...curve, [1, ends[1]] as const].map(
    ([x, y]) => [(x * 100).toFixed(2), ((1 - y) * 100).toFixed(2)] as const,
  );
  const line = corners.map((corner) => corner.join(',')).join(' ');
  const area = `polygon(0 100%, ${corners.map(([x, y]) => `${x}% ${y}%`).join(', ')}, 100% 100%)`;
  const inWords = ([x, y]: Point) =>
    `${label.toLowerCase()} ${shortNumber(y)} at ${shortNumber(range[0] + x * (range[1] - range[0]))}`;

  return (
    <div
      class="plot curve"
      ref={plot}
      onDblClick={onDoubleClick}
      title="Double-click adds or removes a point. With a point focused: arrow keys move it, Enter adds, Delete removes"
    >
      <div class="plot-paint" style={{ background: paint, clipPath: area }} />
      <svg viewBox="0 0 100 100" preserveAspectRatio="none" aria-hidden="true">
        {histogram && <path class="plot-bars" d={histogramPath(histogram, range[0], range[1], 100, 100)} />}
        <polyline class="curve-line" points={line} />
      </svg>
      {onMoveLine && <CurveLines plot={plot} lines={lines} onMove={onMoveLine} />}
      {curve.map(([x, y], index) => (
        <div
          key={index}
          ref={(element) => void (handles.current[index] = element)}
          class="handle"
          role="slider"
          tabIndex={0}
          aria-label={`${label} point ${index + 1} of ${curve.length}`}
          aria-orientation="vertical"
          aria-valuemin={0}
          aria-valuemax={1}
          aria-valuenow={y}
          aria-valuetext={inWords([x, y])}
          title={inWords([x, y])}
          style={{ left: `${x * 100}%`, bottom: `${y * 100}%` }}
          onPointerDown={(event) => {
            event.stopPropagation();
            followPointer(event, (next) => {
              const to = fractionIn(plot.current!, next);
              change(movePoint(latest.current, index, [to.x, to.y]));
            });
          }}
          onDblClick={(event) => {
            event.stopPropagation();
            change(removePoint(curve, index));
          }}
          onKeyDown={(event) => onKey(event, index)}
        />
      ))}
    </div>
  );
}
