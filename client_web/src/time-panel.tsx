// SPDX-License-Identifier: Apache-2.0
// Below the picture of a time series: which step is shown, and the controls that play it.
import { useEffect, useRef } from 'preact/hooks';
import { shortNumber } from './controls';
import { kRates } from './time-player';
import type { Store } from './store';

const kTyped = 'input:not([type=range], [type=checkbox], [type=color]), textarea, [contenteditable]';

/** -1 for the key [ and 1 for ], unless the key writes text or belongs to a shortcut of the browser. */
export function stepOfKey(event: KeyboardEvent): 1 | -1 | undefined {
  // On some keyboards the brackets need AltGr, which is reported as Control and Alt.
  const isShortcut = (event.ctrlKey || event.altKey || event.metaKey) && !event.getModifierState('AltGraph');
  if (isShortcut || event.defaultPrevented || (event.target as Element | null)?.closest?.(kTyped)) return undefined;
  return event.key === '[' ? -1 : event.key === ']' ? 1 : undefined;
}

/** "1.5 s"; empty if the file does not tell the times. */
export function timeText(values: readonly number[], unit: string, step: number): string {
  const value = values[step];
  return value === undefined ? '' : `${shortNumber(value)}${unit && ` ${unit}`}`;
}

const kIcons = {
  back: 'M12 3.5 6 8l6 4.5zM4 3.5v9',
  forward: 'M4 3.5 10 8l-6 4.5zM12 3.5v9',
  play: 'M4.5 3 12.5 8l-8 5z',
  pause: 'M5.5 3.5v9M10.5 3.5v9',
  loop: 'M3 8a4 4 0 0 1 4-4h6m-2-2 2 2-2 2M13 8a4 4 0 0 1-4 4H3m2 2-2-2 2-2',
};

interface IconButtonProps {
  icon: keyof typeof kIcons;
  label: string;
  onClick(): void;
  disabled?: boolean;
  pressed?: boolean;
  keys?: string;
}

function IconButton({ icon, label, onClick, disabled, pressed, keys }: IconButtonProps) {
  return (
    <button
      type="button"
      aria-label={label}
      aria-pressed={pressed}
      aria-keyshortcuts={keys}
      disabled={disabled}
      title={keys ? `${label} (${keys})` : label}
      onClick={onClick}
    >
      <svg viewBox="0 0 16 16" aria-hidden="true">
        <path d={kIcons[icon]} />
      </svg>
    </button>
  );
}

export function TimePanel({ store }: { store: Store }) {
  return store.player.isSeries ? <TimeControls store={store} /> : null;
}

function TimeControls({ store }: { store: Store }) {
  const { player } = store;
  const { count } = player;
  const shown = store.datasets.shown.value;
  // While another data set is loaded, the picture stays, and with it the step.
  const disabled = store.scene.value?.dataset !== shown?.id;
  const last = useRef(player.step);
  if (!disabled) last.current = player.step;
  const step = Math.min(last.current, count - 1);
  const { values = [], unit = '' } = shown?.times ?? {};
  const time = timeText(values, unit, step);
  const playing = player.playing.value;

  useEffect(() => {
    if (disabled) return undefined;
    const onKey = (event: KeyboardEvent) => {
      const by = stepOfKey(event);
      if (by) player.move(by);
    };
    window.addEventListener('keydown', onKey);
    return () => window.removeEventListener('keydown', onKey);
  }, [player, disabled]);

  return (
    <section class="time" aria-label="Time">
      <div class="time-buttons">
        <IconButton icon="back" label="Step back" keys="[" disabled={disabled} onClick={() => player.move(-1)} />
        <IconButton
          icon={playing ? 'pause' : 'play'}
          label={playing ? 'Pause' : 'Play'}
          disabled={disabled}
          onClick={() => player.toggle()}
        />
        <IconButton icon="forward" label="Step forward" keys="]" disabled={disabled} onClick={() => player.move(1)} />
      </div>
      <input
        type="range"
        min={0}
        max={count - 1}
        step={1}
        value={step}
        disabled={disabled}
        aria-label="Time step"
        aria-valuetext={`Step ${step + 1} of ${count}${time && `, ${time}`}`}
        onInput={(event) => player.go(event.currentTarget.valueAsNumber)}
      />
      <output class="time-value">
        <b>
          {step + 1} / {count}
        </b>
        {time && ` ${time}`}
      </output>
      <select
        aria-label="Steps per second"
        title="Steps per second"
        value={player.rate.value}
        onChange={(event) => (player.rate.value = Number(event.currentTarget.value))}
      >
        {kRates.map((rate) => (
          <option key={rate} value={rate}>
            {rate} / s
          </option>
        ))}
      </select>
      <IconButton
        icon="loop"
        label="Loop"
        pressed={player.loop.value}
        onClick={() => (player.loop.value = !player.loop.value)}
      />
    </section>
  );
}
