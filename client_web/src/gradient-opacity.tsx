// SPDX-License-Identifier: Apache-2.0
// A channel's opacity by the magnitude of the gradient: a switch, and below it, when on, the range of magnitudes
// and the curve of the factor over that range.
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

/** Mounted while it is seen: its histogram is fetched for as long as that. */
function GradientEditors({ store, index, path, settings }: Props) {
  const dataset = store.datasets.shown.value;
  useEffect(() => dataset && store.gradientHistograms.want(dataset, index), [store, dataset, index]);
  const histogram = dataset && store.gradientHistograms.of(dataset, index).value;
  const rangeField = fieldAt([...path, 'range']);
  const pointsField = fieldAt([...path, 'points']);
  // Until the server has resolved it, about where it will be.
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
        title="Range and factor as they are when this is switched on"
        onClick={() => store.set(path, { range: null, points: null })}
      >
        Reset
      </button>
    </div>
  );
}
