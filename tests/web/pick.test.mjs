// SPDX-License-Identifier: Apache-2.0
// When the pointer rests over the picture, a corner shows what is visible there: the same as a script gets from the
// server.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import {
  AxeBuilder,
  eventually,
  generateOrbitals,
  launchBrowser,
  openPage,
  patchFromOutside,
  scratchFolder,
  startServer,
  steadyPicture,
} from './support.mjs';

let server, browser, page, faults, box, readout;

before(async () => {
  server = await startServer([generateOrbitals(scratchFolder(), 'orbitals.nrrd', ['--size', '24'])]);
  browser = await launchBrowser();
  ({ page, faults } = await openPage(browser, server.url));
  await steadyPicture(page, 1);
  box = await page.locator('.picture').boundingBox();
  readout = page.getByRole('group', { name: 'Under the pointer' });
});
after(async () => {
  await browser?.close();
  await server?.end();
});

/** The server's answer to a script for a point in page pixels from the picture's top left corner. */
const pickOnServer = (x, y) =>
  page.evaluate(async ([column, row]) => {
    const { id } = JSON.parse(sessionStorage.getItem('scolopax.session'));
    const answer = await fetch(`api/v1/sessions/${id}/pick?x=${column}&y=${row}`);
    if (!answer.ok) throw new Error(await answer.text());
    return answer.json();
  }, [x, y]);

const middle = () => [Math.round(box.width / 2), Math.round(box.height / 2)];
const moveTo = ([x, y]) => page.mouse.move(box.x + x, box.y + y);
const says = (text, message) => eventually(async () => (await readout.textContent()) === text, `${message}: ${text}`);

async function inWords({ name, channel, values, voxel }) {
  const { datasets } = await page.evaluate(async () => (await fetch('api/v1/datasets')).json());
  const { unit } = datasets[0].channels[channel];
  return `${name} ${Number(values[channel].toPrecision(5))} ${unit} voxel ${voxel.join(', ')}`;
}

test('a pointer that rests over the volume is told channel, value and voxel', async () => {
  const found = await pickOnServer(...middle());
  assert.equal(found.hit, true);
  await moveTo(middle());
  await says(await inWords(found), 'the readout is not what the server told a script');
});

test('what is told has no violation that axe finds', async () => {
  const { violations } = await new AxeBuilder({ page }).analyze();
  assert.deepEqual(violations.map(({ id, impact, nodes }) => [id, impact, nodes[0]?.html]), []);
});

test('nothing is told where nothing is hit', async () => {
  assert.equal((await pickOnServer(2, 2)).hit, false);
  await moveTo([2, 2]);
  await says('', 'something is told of nothing');
  await page.waitForTimeout(600);
  assert.equal(await readout.textContent(), '');
});

test('nothing is told while the picture is dragged, nor beside it', async () => {
  const [x, y] = middle();
  await moveTo([x, y]);
  await eventually(() => readout.textContent(), 'nothing is told');
  await page.mouse.down();
  await moveTo([x + 3, y]);
  await page.waitForTimeout(600);
  assert.equal(await readout.textContent(), '');
  await page.mouse.up();
  await eventually(() => readout.textContent(), 'nothing is told after a drag');
  await page.mouse.move(box.x + box.width + 40, box.y + 40);
  await says('', 'something is told of what is beside the picture');
});

test('an edit changes what is told of a pointer that rests', async () => {
  await moveTo(middle());
  await eventually(() => readout.textContent(), 'nothing is told');
  const { channel } = await pickOnServer(...middle());
  await patchFromOutside(page, { channels: { [channel]: { name: 'renamed' } } });
  await eventually(async () => (await readout.textContent()).startsWith('renamed '), 'the old name is told');
});

test('nothing went wrong in the page meanwhile', () => assert.deepEqual(faults, []));
