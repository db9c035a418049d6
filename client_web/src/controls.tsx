// SPDX-License-Identifier: Apache-2.0
// Controls built from the schema, one for each kind of field. fields.tsx selects among them.
import type { ComponentChildren, JSX } from 'preact';
import { useId, useRef, useState } from 'preact/hooks';
import type { Named } from './api';
import type { Field } from './schema';

const kLogDecades = 2; // a logarithmic slider extends this far to both sides of its first value
const kSliderSteps = 400;
const kNumberLength = 8;

/** Five significant digits, or four if an exponent is needed: enough to recognise a value, and short enough to fit. */
export function shortNumber(value: number): string {
  const plain = String(Number(value.toPrecision(5)));
  return plain.length <= kNumberLength ? plain : Number(value.toPrecision(4)).toExponential();
}

interface RowProps {
  field: Field;
  children: ComponentChildren;
  id?: string;
  /** If given, an "auto" button is shown, which lets the server choose the value. */
  onAutomatic?: () => void;
}

export function Row({ field, children, id, onAutomatic }: RowProps) {
  return (
    <div class="row" title={field.doc}>
      <label for={id}>
        {field.label} {field.unit && field.unit !== field.key && <span class="unit">{field.unit}</span>}
      </label>
      <div class="row-value">
        {children}
        {onAutomatic && (
          <button class="quiet" type="button" onClick={onAutomatic} title={`Let the server choose: ${field.label}`}>
            auto
          </button>
        )}
      </div>
    </div>
  );
}

/**
 * Maps a slider's 0..1 to values: logarithmic for numbers whose minimum is 0 and whose maximum is more than 20 times
 * `reference`, linear within narrow bounds. Otherwise undefined: no slider.
 */
export function sliderScale(field: Field, reference: number | undefined) {
  const { minimum, maximum = Infinity } = field;
  if (minimum === undefined) return undefined;
  const span = maximum - minimum;
  if (field.kind === 'integer') {
    if (span > 256) return undefined;
    return {
      toSlider: (value: number) => (value - minimum) / span,
      toValue: (x: number) => Math.round(minimum + x * span),
    };
  }
  const isScale = minimum === 0 && reference !== undefined && reference > 0 && maximum / reference > 20;
  if (isScale) {
    const low = Math.log10(reference) - kLogDecades;
    const high = Math.min(Math.log10(reference) + kLogDecades, Math.log10(maximum));
    return {
      toSlider: (value: number) => (Math.log10(Math.max(value, 1e-300)) - low) / (high - low),
      toValue: (x: number) => Number((10 ** (low + x * (high - low))).toPrecision(3)),
    };
  }
  if (!(span <= 1000)) return undefined;
  const inset = field.aboveMinimum ? span / kSliderSteps : 0; // the bounds themselves are not allowed
  return {
    toSlider: (value: number) => (value - minimum - inset) / (span - 2 * inset),
    toValue: (x: number) => Number((minimum + inset + x * (span - 2 * inset)).toPrecision(4)),
  };
}

export interface ControlProps<T> {
  field: Field;
  value: T | undefined;
  onChange(value: T | null): void;
}

/** Keeps typed text unchanged until the input is finished, even if the scene changes in the meantime. */
function useTyped(shown: string, onFinish: (text: string) => void) {
  const [typed, setTyped] = useState<string | undefined>(undefined);
  return {
    value: typed ?? shown,
    onInput: (event: JSX.TargetedInputEvent<HTMLInputElement>) => setTyped(event.currentTarget.value),
    onChange: (event: JSX.TargetedEvent<HTMLInputElement>) => {
      setTyped(undefined);
      onFinish(event.currentTarget.value);
    },
    onBlur: () => setTyped(undefined),
  };
}

export function NumberInput({ field, value, onChange, id, label }: ControlProps<number> & { id?: string; label?: string }) {
  const typed = useTyped(value === undefined ? '' : shortNumber(value), (text) => {
    if (text !== '') onChange(Number(text));
    else if (field.automatic) onChange(null);
  });
  return (
    <input
      id={id}
      class="number"
      type="number"
      step={field.kind === 'integer' ? 1 : 'any'}
      min={field.minimum}
      max={field.maximum}
      aria-label={label}
      placeholder={field.automatic ? '–' : undefined}
      {...typed}
    />
  );
}

export function NumberControl({ field, value, onChange }: ControlProps<number>) {
  const id = useId();
  const first = useRef<number | undefined>(undefined);
  first.current ??= typeof field.default === 'number' ? field.default : value;
  const scale = sliderScale(field, first.current);
  return (
    <Row field={field} id={id} onAutomatic={field.automatic && value !== undefined ? () => onChange(null) : undefined}>
      {scale && (
        <input
          type="range"
          min={0}
          max={1}
          step={1 / kSliderSteps}
          aria-label={`${field.label}, slider`}
          aria-valuetext={value === undefined ? 'automatic' : shortNumber(value)}
          value={value === undefined ? 0.5 : scale.toSlider(value)}
          onInput={(event) => onChange(scale.toValue(event.currentTarget.valueAsNumber))}
        />
      )}
      <NumberInput field={field} value={value} onChange={onChange} id={id} />
    </Row>
  );
}

export function ToggleControl({ field, value, onChange }: ControlProps<boolean>) {
  const id = useId();
  return (
    <Row field={field} id={id}>
      <input
        id={id}
        type="checkbox"
        class="switch"
        checked={value ?? false}
        onChange={(event) => onChange(event.currentTarget.checked)}
      />
    </Row>
  );
}

/** The server's text with `names` in quotation marks instead of backquotes. */
const inPrint = (doc: string | undefined) => doc?.replace(/`([^`]+)`/g, '“$1”');

export function EnumControl({ field, value, onChange, choices }: ControlProps<string> & { choices: Named[] }) {
  const id = useId();
  const chosen = choices.find((choice) => choice.name === value);
  return (
    <>
      <Row field={field} id={id}>
        <select id={id} value={value} onChange={(event) => onChange(event.currentTarget.value)}>
          {value !== undefined && !chosen && <option value={value}>{value}</option>}
          {choices.map(({ name, doc }) => (
            <option key={name} value={name} title={inPrint(doc)}>
              {name}
            </option>
          ))}
        </select>
      </Row>
      {chosen?.doc && <p class="note">{inPrint(chosen.doc)}</p>}
    </>
  );
}

export function ColorControl({ field, value, onChange }: ControlProps<string>) {
  const id = useId();
  return (
    <Row field={field} id={id}>
      <span class="mono">{value}</span>
      <input id={id} type="color" value={value} onInput={(event) => onChange(event.currentTarget.value)} />
    </Row>
  );
}

export function TextControl({ field, value, onChange }: ControlProps<string>) {
  const id = useId();
  const typed = useTyped(value ?? '', (text) => onChange(text || null));
  return (
    <Row field={field} id={id}>
      <input id={id} type="text" {...typed} />
    </Row>
  );
}

export function VectorControl({ field, value, onChange }: ControlProps<number[]>) {
  const axes = field.length === 3 ? ['x', 'y', 'z'] : Array.from({ length: field.length }, (_, i) => String(i + 1));
  return (
    <fieldset class="vector" title={field.doc}>
      <legend>
        {field.label} {field.unit && <span class="unit">{field.unit}</span>}
      </legend>
      {axes.map((axis, i) => (
        <NumberInput
          key={axis}
          field={{ ...field, kind: 'number', automatic: false }}
          label={`${field.label} ${axis}`}
          value={value?.[i]}
          onChange={(part) => value && part !== null && onChange(value.map((old, j) => (j === i ? part : old)))}
        />
      ))}
    </fieldset>
  );
}
