// SPDX-License-Identifier: Apache-2.0
// One channel: a row with the most used controls and, when opened, colour map, range, opacity and all other
// fields of a channel in the schema below it.
import { useState } from 'preact/hooks';
import type { Named } from './api';
import { CurveEditor } from './curve-editor';
import { Row, shortNumber, TextControl } from './controls';
import { FieldControls } from './fields';
import { GradientOpacity } from './gradient-opacity';
import { linesOf, valueAtPosition } from './isovalues';
import type { Channel } from './scene.generated';
import type { Json } from './merge-patch';
import { RangeEditor } from './range-editor';
import { fieldAt, leavesBelow, type Path } from './schema';
import type { Store } from './store';

/** Members with their own editor here; all others get the control that fits their schema. */
const kSpecial = new Set(['name', 'visible', 'range', 'color', 'colormap', 'opacity', 'gradientOpacity']);
const furtherFields = leavesBelow(['channels', 0])
  .map((path) => path.slice(2))
  .filter((path) => !kSpecial.has(String(path[0])));

type Colormap = Channel['colormap'];

/** The channel's colours from left to right, as a CSS background. */
export function paintOf(color: string | null | undefined, colormap: Colormap, known: readonly Named[]): string {
  const points = Array.isArray(colormap) ? colormap : known.find((map) => map.name === colormap)?.points;
  if (points) {
    const stops = (points as [number, string][]).map(([at, stop]) => `${stop} ${(at * 100).toFixed(1)}%`);
    return `linear-gradient(90deg, ${stops.join(', ')})`;
  }
  return color ?? 'var(--muted)';
}

export function ChannelCard({ store, index, open: openAtFirst }: { store: Store; index: number; open: boolean }) {
  const [open, setOpen] = useState(openAtFirst);
  const channel = store.scene.value?.channels?.[index];
  const histogram = store.datasets.histograms.value[index];
  const colormaps = store.capabilities.value.colormaps ?? [];
  if (!channel) return null;
  const at = (key: string): Path => ['channels', index, key];
  const name = channel.name ?? store.datasets.shown.value?.channels[index]?.name ?? `Channel ${index + 1}`;
  const unit = store.datasets.shown.value?.channels[index]?.unit;
  const visible = channel.visible ?? true;
  const range = channel.range ?? ([histogram?.minimum ?? 0, histogram?.maximum ?? 1] as const);
  const paint = paintOf(channel.color, channel.colormap, colormaps);
  const isMap = channel.colormap != null;
  const setColor = (color: string | null) => store.edit({ channels: { [index]: { color, colormap: null } } });
  const setColormap = (colormap: string) =>
    colormap === '' ? setColor(null) : store.edit({ channels: { [index]: { colormap, color: null } } });

  return (
    <section class={`channel ${visible ? '' : 'off'}`} aria-label={name}>
      <header>
        <input
          type="checkbox"
          class="switch"
          checked={visible}
          aria-label={`Show ${name}`}
          title={fieldAt(at('visible')).doc}
          onChange={(event) => store.set(at('visible'), event.currentTarget.checked)}
        />
        {isMap ? (
          <span class="swatch" style={{ background: paint }} />
        ) : (
          <input
            type="color"
            class="swatch"
            value={channel.color ?? '#808080'}
            aria-label={`Colour of ${name}`}
            title={fieldAt(at('color')).doc}
            onInput={(event) => setColor(event.currentTarget.value)}
          />
        )}
        <button class="disclosure" type="button" aria-expanded={open} onClick={() => setOpen(!open)}>
          <span class="channel-name">{name}</span>
          <svg viewBox="0 0 16 16" aria-hidden="true">
            <path d="M4 6l4 4 4-4" />
          </svg>
        </button>
      </header>
      {open && (
        <div class="channel-body">
          <TextControl field={fieldAt(at('name'))} value={name} onChange={(text) => store.set(at('name'), text)} />
          <Row field={fieldAt(at('colormap'))} id={`colormap-${index}`}>
            {isMap && <span class="ramp" style={{ background: paint }} />}
            <select
              id={`colormap-${index}`}
              value={Array.isArray(channel.colormap) ? '?' : (channel.colormap ?? '')}
              onChange={(event) => setColormap(event.currentTarget.value)}
            >
              <option value="">single colour</option>
              {Array.isArray(channel.colormap) && <option value="?">custom control points</option>}
              {colormaps.map(({ name: map, doc }) => (
                <option key={map} value={map} title={doc}>
                  {map}
                </option>
              ))}
            </select>
          </Row>
          <h4>Range {unit && <span class="unit">{unit}</span>}</h4>
          <RangeEditor
            field={fieldAt(at('range'))}
            range={range as [number, number]}
            histogram={histogram}
            onChange={(next) => store.set(at('range'), next)}
          />
          <h4>Opacity</h4>
          <CurveEditor
            label={fieldAt(at('opacity')).label}
            curve={(channel.opacity ?? [[0, 0], [1, 1]]) as [number, number][]}
            range={range as [number, number]}
            histogram={histogram}
            paint={paint}
            onChange={(curve) => store.set(at('opacity'), curve as unknown as Json)}
            lines={linesOf(channel, range, shortNumber)}
            onMoveLine={(line, [position, opacity]) =>
              store.set([...at('isovalues'), line], {
                value: valueAtPosition(position, range, channel.gamma ?? 1),
                opacity: Number(opacity.toFixed(3)),
              })
            }
          />
          <GradientOpacity store={store} index={index} />
          <FieldControls store={store} paths={furtherFields.map((path) => ['channels', index, ...path])} />
        </div>
      )}
    </section>
  );
}
