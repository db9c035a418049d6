// SPDX-License-Identifier: Apache-2.0
// A list of objects, such as the lights. Every item has controls for its fields and can be removed; items can be added
// up to the schema's maximum. Edits of an item are patches by its index, as elsewhere.
import { useLayoutEffect, useRef, useState } from 'preact/hooks';
import { FieldControls } from './fields';
import { itemsAt, withAdded, withRemoved } from './list-items';
import type { Json } from './merge-patch';
import { fieldAt, leavesBelow, type Path } from './schema';
import type { Store } from './store';

export function ListControl({ store, path }: { store: Store; path: Path }) {
  const field = fieldAt(path);
  const items = itemsAt(store.scene.value as Json | undefined, path);
  const name = field.itemLabel;
  const list = useRef<HTMLFieldSetElement>(null);
  const adder = useRef<HTMLButtonElement>(null);
  const [said, say] = useState('');

  // The clicked button may not exist after the edit: move the focus to the control that a user needs next.
  const moveFocus = useRef<(() => void) | undefined>(undefined);
  useLayoutEffect(() => {
    moveFocus.current?.();
    moveFocus.current = undefined;
  });
  const itemElement = (index: number) => list.current?.querySelectorAll(':scope > .item')[index];

  const add = () => {
    moveFocus.current = () => itemElement(items.length)?.querySelector<HTMLElement>('.item-body :is(select, input)')?.focus();
    say(`${name} ${items.length + 1} added`);
    store.set(path, withAdded(items, path));
  };
  const remove = (index: number) => {
    moveFocus.current = () => {
      const next = itemElement(Math.min(index, items.length - 2));
      (next?.querySelector<HTMLElement>(':scope > .remove') ?? adder.current)?.focus();
    };
    say(`${name} ${index + 1} removed, ${items.length - 1} left`);
    store.set(path, withRemoved(items, path, index));
  };

  return (
    <fieldset class="list" ref={list}>
      <legend>
        <h3>{field.label}</h3>
      </legend>
      <p class="note">{field.doc}</p>
      {items.map((_, index) => (
        <fieldset key={index} class="item">
          <legend>
            {name} {index + 1}
          </legend>
          <button type="button" class="quiet remove" aria-label={`Remove ${name.toLowerCase()} ${index + 1}`} onClick={() => remove(index)}>
            Remove
          </button>
          <div class="item-body">
            <FieldControls store={store} paths={leavesBelow([...path, index])} />
          </div>
        </fieldset>
      ))}
      <button
        type="button"
        class="wide"
        ref={adder}
        disabled={items.length >= field.maxItems}
        title={items.length >= field.maxItems ? `At most ${field.maxItems}` : undefined}
        onClick={add}
      >
        Add {name.toLowerCase()}
      </button>
      <p class="unseen" aria-live="polite">
        {said}
      </p>
    </fieldset>
  );
}
