// SPDX-License-Identifier: Apache-2.0
// A channel's opacity by the magnitude of the gradient: a switch and, when it is on, the range of magnitudes and the
// curve of the factor over that range.
import { useEffect, useState } from 'preact/hooks';
import { ToggleControl } from './controls';
import type { Curve } from './curve';
import { CurveEditor } from './curve-editor';
import type { Json } from './merge-patch';
import { RangeEditor } from './range-editor';
import type { Channel } from './scene.generated';
import { fieldAt, type Path } from './schema';
import type { Store } from './store';

const kLabel = 'Opacity by gradient';

type Settings = NonNullable<Channel['gradientOpacity']>;

export function GradientOpacity({ store, index }: { store: Store; index: number }) {
  const path = ['channels', index, 'gradientOpacity'];
  const settings = store.scene.value?.channels?.[index]?.gradientOpacity;
  const [open, setOpen] = useState(settings != null);
  return (
    <details open={open} onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary>Gradient</summary>
      <ToggleControl
        field={{ ...fieldAt(path), label: kLabel }}
        value={settings != null}
        onChange={(on) => store.set(path, on ? {} : null)}
      />
      {open && settings && <GradientEditors store={store} index={index} path={path} settings={settings} />}
    </details>
  );
}

interface Props {
  store: Store;
  index: number;
  path: Path;
  settings: Settings;
}

/** Mounted only while visible; unmounting cancels the request for its histogram. */
function GradientEditors({ store, index, path, settings }: Props) {
  const dataset = store.datasets.shown.value;
  useEffect(() => dataset && store.gradientHistograms.want(dataset, index), [store, dataset, index]);
  const histogram = dataset && store.gradientHistograms.of(dataset, index).value;
  const rangeField = fieldAt([...path, 'range']);
  const pointsField = fieldAt([...path, 'points']);
  // An approximation until the server has resolved the range.
  const range = settings.range ?? ([0, histogram?.maximum ?? 1] as const);
  return (
    <div role="group" aria-label={kLabel}>
      <h4>
        {rangeField.label} <span class="unit">{rangeField.unit}</span>
      </h4>
      <RangeEditor
        field={{ ...rangeField, label: 'Gradient range' }}
        range={range}
        histogram={histogram}
        onChange={(next) => store.set([...path, 'range'], next)}
      />
      <h4 title={pointsField.doc}>Factor</h4>
      <CurveEditor
        label="Factor"
        curve={settings.points ?? (pointsField.default as Curve)}
        range={range}
        histogram={histogram}
        paint="var(--muted)"
        onChange={(curve) => store.set([...path, 'points'], curve as unknown as Json)}
      />
      <button
        type="button"
        class="wide"
        title="Restore the initial range and factor"
        onClick={() => store.set(path, { range: null, points: null })}
      >
        Reset
      </button>
    </div>
  );
}
