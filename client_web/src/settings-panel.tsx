// SPDX-License-Identifier: Apache-2.0
// Render settings. The most used ones come first; all other fields of the scene follow under "More settings", where
// a new field of the schema appears without a change here.
import { FieldControl, FieldControls } from './fields';
import { ListControl } from './list-control';
import { fieldAt, leavesBelow, type Path } from './schema';
import type { Store } from './store';

const kFirst = [
  { path: ['blend', 'mode'], label: 'Blend mode' },
  { path: ['integrator', 'method'], label: 'Method' },
  { path: ['image', 'background'], label: 'Background' },
];
/** Fields not under "More settings": edited elsewhere, set from the window's size, or listed in kFirst. */
const kElsewhere = new Set(['dataset', 'time', 'image.width', 'image.height', ...kFirst.map(({ path }) => path.join('.'))]);

const isList = (path: Path) => fieldAt(path).kind === 'list';

/** Every list of objects, such as the lights, has its own section. The channels have cards instead. */
const lists = leavesBelow([]).filter((path) => isList(path) && path[0] !== 'channels');

/** One group for each object of the scene that has fields left. */
const groups: { label: string; paths: Path[] }[] = fieldAt([])
  .members.filter((key) => key !== 'channels' && key !== 'camera')
  .map((key) => ({
    label: fieldAt([key]).label,
    paths: leavesBelow([key]).filter((path) => !isList(path) && !kElsewhere.has(path.join('.'))),
  }))
  .filter(({ paths }) => paths.length > 0);

export function SettingsPanel({ store }: { store: Store }) {
  return (
    <section class="group" aria-labelledby="settings-title">
      <h3 id="settings-title">Rendering</h3>
      {kFirst.map(({ path, label }) => (
        <FieldControl key={label} store={store} path={path} label={label} />
      ))}
      <details>
        <summary>More settings</summary>
        {groups.map(({ label, paths }) => (
          <div key={label} role="group" aria-label={label}>
            {paths[0]!.length > 1 && <h4>{label}</h4>}
            <FieldControls store={store} paths={paths} />
          </div>
        ))}
      </details>
    </section>
  );
}

export function ListSections({ store }: { store: Store }) {
  return (
    <>
      {lists.map((path) => (
        <section key={path.join('.')} class="group">
          <ListControl store={store} path={path} />
        </section>
      ))}
    </>
  );
}
