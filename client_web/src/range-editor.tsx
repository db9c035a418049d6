// SPDX-License-Identifier: Apache-2.0
// Editor of the range of values that a curve spans: two handles over the whole histogram, and two number fields.
import { useRef } from 'preact/hooks';
import { NumberInput } from './controls';
import { fractionIn, followPointer } from './drag';
import { histogramPath, type Histogram } from './histogram';
import type { Field } from './schema';

interface Props {
  field: Field;
  range: readonly [number, number];
  histogram: Histogram | undefined;
  onChange(range: [number, number] | null): void;
}

/** The range of the data, extended to contain `range`; never empty. */
export function plotDomain(range: readonly [number, number], histogram: Histogram | undefined): [number, number] {
  const low = Math.min(range[0], range[1], histogram?.minimum ?? Infinity);
  const high = Math.max(range[0], range[1], histogram?.maximum ?? -Infinity);
  return high > low ? [low, high] : [low - 0.5, low + 0.5];
}

export function RangeEditor({ field, range, histogram, onChange }: Props) {
  const plot = useRef<HTMLDivElement>(null);
  const latest = useRef(range);
  latest.current = range;
  const name = field.label.toLowerCase();
  const [low, high] = plotDomain(range, histogram);
  const fraction = (value: number) => (value - low) / (high - low);
  const setEnd = (end: 0 | 1, value: number) => {
    const bounded = Number(Math.max(low, Math.min(high, value)).toPrecision(6));
    const next: [number, number] = end === 0 ? [bounded, latest.current[1]] : [latest.current[0], bounded];
    latest.current = next;
    onChange(next);
  };
  const onKey = (event: KeyboardEvent, end: 0 | 1) => {
    const step = (high - low) * (event.shiftKey ? 0.1 : 0.01);
    const moves: Record<string, number> = { ArrowLeft: -step, ArrowDown: -step, ArrowRight: step, ArrowUp: step };
    const move = moves[event.key];
    if (move === undefined) return;
    event.preventDefault();
    setEnd(end, range[end] + move);
  };
  const left = Math.min(fraction(range[0]), fraction(range[1]));
  const right = Math.max(fraction(range[0]), fraction(range[1]));

  return (
    <div class="range" title={field.doc}>
      <div class="plot" ref={plot}>
        <svg viewBox="0 0 100 100" preserveAspectRatio="none" aria-hidden="true">
          {histogram && <path class="plot-bars" d={histogramPath(histogram, low, high, 100, 100)} />}
        </svg>
        <div class="plot-shade" style={{ left: 0, width: `${left * 100}%` }} />
        <div class="plot-shade" style={{ left: `${right * 100}%`, right: 0 }} />
        {([0, 1] as const).map((end) => (
          <div
            key={end}
            class="range-handle"
            role="slider"
            tabIndex={0}
            aria-label={`${end === 0 ? 'Lower' : 'Upper'} end of the ${name}`}
            aria-valuemin={low}
            aria-valuemax={high}
            aria-valuenow={range[end]}
            style={{ left: `${fraction(range[end]) * 100}%` }}
            onKeyDown={(event) => onKey(event, end)}
            onPointerDown={(event) =>
              followPointer(event, (next) => setEnd(end, low + fractionIn(plot.current!, next).x * (high - low)))
            }
          />
        ))}
      </div>
      <div class="range-numbers">
        {([0, 1] as const).map((end) => (
          <NumberInput
            key={end}
            field={{ ...field, kind: 'number', automatic: false }}
            label={`${field.label} ${end === 0 ? 'from' : 'to'}`}
            value={range[end]}
            onChange={(value) => {
              if (value !== null) onChange(end === 0 ? [value, range[1]] : [range[0], value]);
            }}
          />
        ))}
        <button class="quiet" type="button" title={`Let the server choose the ${name}`} onClick={() => onChange(null)}>
          auto
        </button>
      </div>
    </div>
  );
}
