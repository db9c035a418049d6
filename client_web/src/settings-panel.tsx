// SPDX-License-Identifier: Apache-2.0
// How the picture is made. The first settings are those most asked for; all others of the scene follow
// under "More settings", so that a new one in the schema appears there by itself.
import { FieldControls } from './fields';
import { leavesBelow, type Path } from './schema';
import type { Store } from './store';

const kFirst = ['blend.mode', 'integrator.method', 'image.background'];
/** Edited elsewhere, or following the window. */
const kElsewhere = /^(dataset|channels|camera|image\.(width|height))(\.|$)/;

const all: Path[] = leavesBelow([]).filter((path) => !kElsewhere.test(path.join('.')));
const first = kFirst.flatMap((name) => all.filter((path) => path.join('.') === name));
const further = all.filter((path) => !first.includes(path));

export function SettingsPanel({ store }: { store: Store }) {
  return (
    <section class="group" aria-labelledby="settings-title">
      <h3 id="settings-title">Rendering</h3>
      <FieldControls store={store} paths={first} />
      <details>
        <summary>More settings</summary>
        <FieldControls store={store} paths={further} />
      </details>
    </section>
  );
}
