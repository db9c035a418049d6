// SPDX-License-Identifier: Apache-2.0
// The page: the picture, the panel beside it (below it on a narrow screen), the status along the edge.
import { useState } from 'preact/hooks';
import { CameraPanel } from './camera-panel';
import { ChannelCard } from './channel-card';
import { DatasetPanel } from './dataset-panel';
import type { FrameView } from './frame-view';
import { LoadCard } from './load-card';
import { PickReadout } from './pick-readout';
import { PictureView } from './picture-view';
import { savePicture } from './save-picture';
import { ListSections, SettingsPanel } from './settings-panel';
import { StatusBar } from './status-bar';
import type { Store } from './store';
import { TimePanel } from './time-panel';
import { Toasts } from './toasts';

/** With at most this many channels, all are shown opened; with more, only the first. */
const kOpenChannels = 2;

export function App({ store, attach }: { store: Store; attach(view: FrameView): void }) {
  const [panel, setPanel] = useState(!window.matchMedia('(max-width: 760px)').matches);
  const channels = store.scene.value?.channels ?? [];
  const key = store.datasets.shown.value?.id ?? '';
  return (
    <div class={`app ${panel ? 'with-panel' : ''}`}>
      <main class="stage">
        <h1 class="unseen">Scolopax</h1>
        <div class="view">
          <PictureView store={store} attach={attach} />
          <div class="tools">
            <button type="button" title="Save the picture (PNG)" onClick={() => void savePicture(store)}>
              <svg viewBox="0 0 16 16" aria-hidden="true">
                <path d="M8 2v8m-3.5-3L8 10.5 11.5 7M2.5 13.5h11" />
              </svg>
              <span class="unseen">Save picture</span>
            </button>
            <button type="button" aria-expanded={panel} aria-controls="panel" title="Settings" onClick={() => setPanel(!panel)}>
              <svg viewBox="0 0 16 16" aria-hidden="true">
                <path d="M2 4.5h7m4 0h1M2 11.5h1m4 0h7M9 2.5v4M7 9.5v4" />
              </svg>
              <span class="unseen">Settings</span>
            </button>
          </div>
          <PickReadout store={store} />
          <LoadCard store={store} />
          <Toasts store={store} />
        </div>
        <TimePanel store={store} />
        <StatusBar store={store} />
      </main>
      <aside id="panel" class="panel" hidden={!panel} aria-label="Settings">
        <DatasetPanel store={store} />
        {store.scene.value && (
          <>
            <section class="group" aria-labelledby="channels-title">
              <h3 id="channels-title">Channels</h3>
              {channels.length === 0 && store.choice.loading.value && (
                <p class="note">They are shown when the data set has been loaded.</p>
              )}
              {channels.map((_, index) => (
                <ChannelCard
                  key={`${key} ${index}`}
                  store={store}
                  index={index}
                  open={channels.length <= kOpenChannels || index === 0}
                />
              ))}
            </section>
            <SettingsPanel store={store} />
            <CameraPanel store={store} />
            <ListSections store={store} />
          </>
        )}
      </aside>
    </div>
  );
}
