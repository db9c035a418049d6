// SPDX-License-Identifier: Apache-2.0
// Starts the page: the store opens the stream; the picture view draws the frames it receives.
import { render } from 'preact';
import { App } from './app';
import type { FrameView } from './frame-view';
import { Store } from './store';
import './style.css';

let view: FrameView | undefined;
const store = new Store((message) => {
  try {
    view?.show(message);
  } catch (error) {
    store.toasts.say(String(error instanceof Error ? error.message : error));
  }
});

render(<App store={store} attach={(next) => (view = next)} />, document.getElementById('app')!);
store.start();
