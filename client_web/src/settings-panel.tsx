// SPDX-License-Identifier: Apache-2.0
// How the picture is made. The first settings are those most asked for; all others of the scene follow
// under "More settings", so that a new one in the schema appears there by itself.
import { FieldControl, FieldControls } from './fields';
import { ListControl } from './list-control';
import { fieldAt, leavesBelow, type Path } from './schema';
import type { Store } from './store';

const kFirst = [
  { path: ['blend', 'mode'], label: 'Blend mode' },
  { path: ['integrator', 'method'], label: 'Method' },
  { path: ['image', 'background'], label: 'Background' },
];
/** Edited elsewhere, following the window, or above. */
const kElsewhere = new Set(['dataset', 'image.width', 'image.height', ...kFirst.map(({ path }) => path.join('.'))]);

const isList = (path: Path) => fieldAt(path).kind === 'list';

/** Every list of objects, such as the lights, has a section of its own; the channels have their cards. */
const lists = leavesBelow([]).filter((path) => isList(path) && path[0] !== 'channels');

/** One group for each object of the scene that has something left. */
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
