// SPDX-License-Identifier: Apache-2.0
// Shows messages until they are dismissed.
import type { Store } from './store';

export function Toasts({ store }: { store: Store }) {
  return (
    <div class="toasts" role="alert">
      {store.toasts.all.value.map(({ id, field, text }) => (
        <div class="toast" key={id}>
          <p>
            {field && <b>{field}: </b>}
            {text}
          </p>
          <button type="button" aria-label="Dismiss" onClick={() => store.toasts.dismiss(id)}>
            ×
          </button>
        </div>
      ))}
    </div>
  );
}
