// SPDX-License-Identifier: Apache-2.0
// Controls for the channels that a plane clips, and for the regions of the volume that are kept. fields.tsx selects
// them by the kind of field.
import { useId } from 'preact/hooks';
import { Row, type ControlProps } from './controls';
import { kRegions } from './schema';

/** A check box for every channel. An undefined `value` means all channels; choosing all calls `onChange(null)`. */
export function ChannelsControl({ field, value, names, onChange }: ControlProps<number[]> & { names: string[] }) {
  const all = names.map((_, i) => i);
  const chosen = value ?? all;
  const toggle = (channel: number, on: boolean) => {
    const next = all.filter((i) => (i === channel ? on : chosen.includes(i)));
    onChange(next.length === all.length ? null : next);
  };
  return (
    <fieldset class="choices" title={field.doc}>
      <legend>{field.label}</legend>
      {names.map((name, i) => (
        <label key={i}>
          <input type="checkbox" checked={chosen.includes(i)} onChange={(event) => toggle(i, event.currentTarget.checked)} />
          {name}
        </label>
      ))}
    </fieldset>
  );
}

/** Bit x + 3 y + 9 z: region (x, y, z) is kept. The names and sets are those of VTK's volume mappers. */
const kRegionSets = [
  { name: 'Inside', bits: 0x0002000 },
  { name: 'Outside', bits: 0x7ffdfff },
  { name: 'Fence', bits: 0x2ebfeba },
  { name: 'Inverted fence', bits: 0x5140145 },
  { name: 'Cross', bits: 0x0417410 },
  { name: 'Inverted cross', bits: 0x7be8bef },
];
const kPlaces = ['low', 'middle', 'high'];

const bitsOf = (regions: boolean[]) => regions.reduce((bits, kept, i) => bits | (Number(kept) << i), 0);
const regionsOf = (bits: number) => Array.from({ length: kRegions }, (_, i) => ((bits >> i) & 1) === 1);

export function RegionsControl({ field, value, onChange }: ControlProps<boolean[]>) {
  const id = useId();
  const regions = value ?? (field.default as boolean[]);
  const bits = bitsOf(regions);
  const known = kRegionSets.some((set) => set.bits === bits);
  return (
    <>
      <Row field={field} id={id}>
        <select id={id} value={String(bits)} onChange={(event) => onChange(regionsOf(Number(event.currentTarget.value)))}>
          {!known && <option value={String(bits)}>Custom</option>}
          {kRegionSets.map((set) => (
            <option key={set.name} value={String(set.bits)}>
              {set.name}
            </option>
          ))}
        </select>
      </Row>
      <details class="regions">
        <summary>Individual regions</summary>
        {kPlaces.map((place, z) => (
          <fieldset key={place}>
            <legend>z {place}</legend>
            {[0, 1, 2, 3, 4, 5, 6, 7, 8].map((inSlab) => {
              const region = 9 * z + inSlab;
              return (
                <input
                  key={region}
                  type="checkbox"
                  aria-label={`x ${kPlaces[inSlab % 3]}, y ${kPlaces[Math.floor(inSlab / 3)]}, z ${place}`}
                  checked={regions[region]}
                  onChange={(event) => onChange(regions.map((kept, i) => (i === region ? event.currentTarget.checked : kept)))}
                />
              );
            })}
          </fieldset>
        ))}
      </details>
    </>
  );
}
