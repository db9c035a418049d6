// SPDX-License-Identifier: Apache-2.0
// The control for any field of the scene, given its path. Kind, bounds and text come from the schema, the choices
// of an enumerated field from the running server.
import { valueAt, type Json } from './merge-patch';
import {
  ColorControl,
  EnumControl,
  NumberControl,
  TextControl,
  ToggleControl,
  VectorControl,
} from './controls';
import { ChannelsControl, RegionsControl } from './clipping-controls';
import { ListControl } from './list-control';
import { choicesOf, fieldAt, type Path } from './schema';
import type { Store } from './store';

const channelNames = (store: Store) =>
  (store.scene.value?.channels ?? []).map(({ name }, i) => name ?? `Channel ${i + 1}`);

export function FieldControl({ store, path, label }: { store: Store; path: Path; label?: string }) {
  const found = fieldAt(path);
  const field = label ? { ...found, label } : found;
  const scene = store.scene.value as Json | undefined;
  const value = valueAt(scene, path) ?? (scene && field.default); // an item just added is still empty
  const props = { field, onChange: (next: Json) => store.set(path, next) };
  switch (field.kind) {
    case 'number':
    case 'integer':
      return <NumberControl {...props} value={value as number | undefined} />;
    case 'toggle':
      return <ToggleControl {...props} value={value as boolean | undefined} />;
    case 'enum':
      return <EnumControl {...props} value={value as string | undefined} choices={choicesOf(path, store.capabilities.value)} />;
    case 'color':
      return <ColorControl {...props} value={value as string | undefined} />;
    case 'text':
      return <TextControl {...props} value={value as string | undefined} />;
    case 'vector':
      return <VectorControl {...props} value={value as number[] | undefined} />;
    case 'channels':
      return <ChannelsControl {...props} value={value as number[] | undefined} names={channelNames(store)} />;
    case 'regions':
      return <RegionsControl {...props} value={value as boolean[] | undefined} />;
    case 'list':
      return <ListControl store={store} path={path} />;
    default:
      return null;
  }
}

export function FieldControls({ store, paths }: { store: Store; paths: Path[] }) {
  return (
    <>
      {paths.map((path) => (
        <FieldControl key={path.join('.')} store={store} path={path} />
      ))}
    </>
  );
}
