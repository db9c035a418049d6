// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from 'vitest';
import { sliderScale } from '../src/controls';
import { choicesOf, fieldAt, leavesBelow, sayPointer } from '../src/schema';

describe('the schema', () => {
  it('says of each field what its control needs', () => {
    expect(fieldAt(['channels', 3, 'visible']).kind).toBe('toggle');
    expect(fieldAt(['channels', 0, 'color']).kind).toBe('color');
    expect(fieldAt(['camera', 'eye'])).toMatchObject({ kind: 'vector', length: 3, automatic: true });
    expect(fieldAt(['channels', 0, 'gamma'])).toMatchObject({ kind: 'number', minimum: 0, aboveMinimum: true, automatic: false });
    expect(fieldAt(['channels', 0, 'density'])).toMatchObject({ kind: 'number', automatic: true });
    expect(fieldAt(['integrator', 'seed']).kind).toBe('integer');
    expect(fieldAt(['camera', 'orthoHeight']).label).toBe('Ortho height');
    expect(fieldAt(['camera', 'eye']).doc.length).toBeGreaterThan(10);
  });

  it('knows every field of the scene, so that none is without a control by mistake', () => {
    const names = leavesBelow([]).map((path) => path.join('.'));
    expect(names).toContain('blend.mode');
    expect(names).toContain('stop.seconds');
    expect(leavesBelow(['channels', 0]).map((path) => path[2])).toContain('density');
  });

  it('refuses a path that it does not have', () => {
    expect(() => fieldAt(['camera', 'roll'])).toThrow(/camera.roll/);
  });

  it('knows lists of objects, and what one of their items is', () => {
    expect(fieldAt(['lights'])).toMatchObject({ kind: 'list', label: 'Lights', itemLabel: 'Light', maxItems: 8 });
    expect(fieldAt(['channels']).kind).toBe('list');
    expect(fieldAt(['channels', 0, 'opacity']).kind).toBe('other'); // a list of pairs, which has an editor of its own
    expect(leavesBelow([]).map((path) => path.join('.'))).toContain('lights');
    expect(leavesBelow(['lights', 2])).toContainEqual(['lights', 2, 'intensity']);
  });

  it('knows lists of channels and the regions of a volume', () => {
    expect(fieldAt(['clip', 0, 'media'])).toMatchObject({ kind: 'channels', automatic: true });
    expect(fieldAt(['crop', 'regions']).kind).toBe('regions');
    expect(fieldAt(['crop', 'x'])).toMatchObject({ kind: 'vector', length: 2 });
  });

  it('opens an object that may be null, and reads what its members are', () => {
    const path = ['channels', 0, 'gradientOpacity'];
    expect(fieldAt(path)).toMatchObject({ kind: 'object', automatic: true });
    expect(fieldAt(path).doc.length).toBeGreaterThan(10);
    expect(fieldAt([...path, 'range'])).toMatchObject({ kind: 'vector', length: 2, automatic: true, label: 'Range' });
    expect(fieldAt([...path, 'range']).unit).not.toBe('');
    expect(fieldAt([...path, 'points'])).toMatchObject({ kind: 'other', default: [[0, 0], [1, 1]] });
    expect(sayPointer('/channels/0/gradientOpacity/range/1')).toBe('Channel 1, gradientOpacity, range, 1');
  });

  it('takes choices from that list of the running server which has the names, else from itself', () => {
    const capabilities = {
      version: '1',
      imageFormats: ['point'],
      aovs: [{ name: 'density' }],
      filters: [{ name: 'box' }, { name: 'point', doc: 'centres' }],
      lightTypes: [{ name: 'point', doc: 'from all sides' }, { name: 'directional' }, { name: 'only here' }],
      blendModes: ['density', 'max', 'only here'].map((name) => ({ name, doc: name })),
    };
    expect(choicesOf(['blend', 'mode'], capabilities)).toBe(capabilities.blendModes);
    expect(choicesOf(['lights', 0, 'type'], capabilities)).toBe(capabilities.lightTypes);
    expect(choicesOf(['image', 'filter'], capabilities)).toBe(capabilities.filters);
    expect(choicesOf(['blend', 'mode'], { aovs: capabilities.aovs }).map(({ name }) => name)).toContain('max');
    expect(choicesOf(['blend', 'mode'], {}).map((choice) => choice.name)).toContain('density');
  });

  it('names the field of a problem in words', () => {
    expect(sayPointer('/channels/0/gamma')).toBe('Channel 1, gamma');
    expect(sayPointer('/camera/eye')).toBe('camera, eye');
    expect(sayPointer('/lights/1/type')).toBe('Light 2, type');
    expect(sayPointer('/channels/1/opacity/0')).toBe('Channel 2, opacity, 0');
    expect(sayPointer('/unheard/0/of')).toBe('unheard, 0, of');
  });
});

describe('a slider', () => {
  it('of a scale is logarithmic around its first value and stays within the bounds', () => {
    const scale = sliderScale(fieldAt(['channels', 0, 'gamma']), 1)!;
    expect(scale.toSlider(1)).toBeCloseTo(0.5, 12);
    expect(scale.toValue(0)).toBeCloseTo(0.01, 12);
    expect(scale.toValue(1)).toBeCloseTo(100, 9);
  });
  it('of an angle is linear and stays off bounds that are not allowed', () => {
    const scale = sliderScale(fieldAt(['camera', 'fovY']), 35)!;
    expect(scale.toValue(0)).toBeGreaterThan(0);
    expect(scale.toValue(1)).toBeLessThan(180);
    expect(scale.toValue(scale.toSlider(90))).toBeCloseTo(90, 6);
  });
  it('is not offered where no position could mean a value', () => {
    expect(sliderScale(fieldAt(['integrator', 'seed']), 0)).toBeUndefined();
    expect(sliderScale(fieldAt(['stop', 'seconds']), undefined)).toBeUndefined();
  });
});

describe('units', () => {
  it('are those that the schema names', () => {
    expect(fieldAt(['camera', 'fovY']).unit).toBe('degrees');
    expect(fieldAt(['channels', 0, 'density']).unit).toBe('1 / world unit');
    expect(fieldAt(['channels', 0, 'gamma']).unit).toBe('');
  });
});
