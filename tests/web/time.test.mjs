// SPDX-License-Identifier: Apache-2.0
// A time series on the page: stepping, playing, keys.
import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import path from 'node:path';
import { after, before, test } from 'node:test';
import {
  AxeBuilder,
  dataDir,
  difference,
  eventually,
  generateOrbitals,
  launchBrowser,
  openPage,
  sceneOnServer,
  scratchFolder,
  startServer,
  steadyPicture,
  writeSeries,
} from './support.mjs';

const kTimes = 6;
const kReal = path.join(dataDir, 'timeseries/example4d.nii.gz');
let server, browser, page, faults;
const timePanel = () => page.getByRole('region', { name: 'Time' });
const slider = () => page.getByRole('slider', { name: 'Time step' });
const button = (name) => timePanel().getByRole('button', { name, exact: true });
const step = async () => Number(await slider().inputValue());
const timeOnServer = async () => (await sceneOnServer(page)).scene.time;
const dataset = (name) => page.getByRole('region', { name: 'Data set' }).getByRole('button', { name });

before(async () => {
  const folder = scratchFolder();
  const files = [writeSeries(folder, kTimes), writeSeries(folder, 3, 24, 'short.nrrd'), generateOrbitals(folder)];
  server = await startServer(existsSync(kReal) ? [...files, kReal] : files);
  browser = await launchBrowser();
  ({ page, faults } = await openPage(browser, server.url));
});
after(async () => {
  await browser?.close();
  await server?.end();
});

test('a series begins at its first step, and says when that is', async () => {
  const picture = await steadyPicture(page);
  assert.ok(Math.max(...picture.blocks) > 30, 'the picture is dark');
  assert.equal(await step(), 0);
  assert.match(await timePanel().textContent(), /1 \/ 6/);
  assert.match(await slider().getAttribute('aria-valuetext'), /^Step 1 of 6/);
});

test('a step forward and back changes the picture and restores it', async () => {
  const first = await steadyPicture(page);
  await button('Step forward').click();
  await eventually(async () => (await timeOnServer()) === 1, 'the step did not arrive');
  const second = await steadyPicture(page);
  assert.ok(difference(first, second) > 8, `the picture hardly changed: ${difference(first, second)}`);
  await button('Step back').click();
  const again = await steadyPicture(page);
  assert.ok(difference(first, again) < 4, 'the first step looks different now');
});

test('the slider chooses a step', async () => {
  const first = await steadyPicture(page);
  await slider().fill('4');
  await eventually(async () => (await timeOnServer()) === 4, 'the step did not arrive');
  assert.ok(difference(first, await steadyPicture(page)) > 8);
  await slider().focus();
  await page.keyboard.press('Home');
  await eventually(async () => (await timeOnServer()) === 0, 'the keys of the slider do nothing');
});

test('the brackets step, except where text is typed', async () => {
  await page.locator('.picture').focus();
  await page.keyboard.press(']');
  await page.keyboard.press(']');
  await page.keyboard.press('[');
  assert.equal(await step(), 1);
  await page.getByLabel('Gamma', { exact: true }).first().focus();
  await page.keyboard.press(']');
  assert.equal(await step(), 1);
  await page.locator('.picture').focus();
  await page.keyboard.press('[');
  assert.equal(await step(), 0);
});

test('it plays, begins again at the end, and pauses', async () => {
  await steadyPicture(page, 1);
  await page.getByRole('combobox', { name: 'Steps per second' }).selectOption('10');
  await button('Play').focus();
  await page.keyboard.press('Space');
  const seen = new Set();
  let again = false;
  await eventually(async () => {
    const now = await step();
    again ||= seen.size === kTimes && now === 1;
    seen.add(now);
    await page.waitForTimeout(10);
    return again;
  }, `it does not play in a loop: only ${[...seen]} were shown`);
  await page.keyboard.press('Space');
  assert.equal(await button('Play').count(), 1);
  const paused = await step();
  await eventually(async () => (await timeOnServer()) === paused, 'the server has another step than the page');
  await page.waitForTimeout(500);
  assert.equal(await step(), paused);
});

test('without the loop it stops at the end, and plays from the beginning then', async () => {
  await button('Loop').click();
  assert.equal(await button('Loop').getAttribute('aria-pressed'), 'false');
  await slider().fill(String(kTimes - 2));
  await button('Play').click();
  await eventually(async () => (await button('Play').count()) === 1, 'it plays on');
  assert.equal(await step(), kTimes - 1);
  await button('Play').click();
  await eventually(async () => (await step()) === 1, 'it does not begin again');
  await eventually(async () => (await button('Play').count()) === 1, 'it plays on');
  await button('Loop').click();
});

test('a data set with fewer times begins at its first one', async () => {
  await slider().fill('5');
  await dataset(/short/).click();
  await eventually(async () => (await timePanel().textContent()).includes('1 / 3'), 'the short series is not shown');
  await steadyPicture(page, 2);
  assert.equal(await timeOnServer(), 0);
  await dataset(/orbitals/).click();
  await eventually(async () => (await timePanel().count()) === 0, 'a single time has a panel');
  await dataset(/series/).click();
  await timePanel().waitFor();
  assert.equal(await page.locator('.toast').count(), 0);
});

test('axe finds no violation', async () => {
  await steadyPicture(page, 1);
  const { violations } = await new AxeBuilder({ page }).analyze();
  assert.deepEqual(violations.map(({ id, impact, nodes }) => [id, impact, nodes[0]?.html]), []);
});

test('on a telephone the panel of the time fits', async () => {
  const phone = await openPage(browser, server.url, { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  await steadyPicture(phone.page, 2);
  assert.ok(await phone.page.getByRole('slider', { name: 'Time step' }).isVisible());
  const overflow = await phone.page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.equal(overflow, 0);
  assert.deepEqual(phone.faults, []);
  await phone.page.context().close();
});

test('a measured series is stepped through', { skip: !existsSync(kReal) && 'no shared data' }, async () => {
  await dataset(/example4d/).click();
  await eventually(async () => /1 \/ \d+/.test(await timePanel().textContent()), 'it is not shown');
  const picture = await steadyPicture(page);
  assert.ok(Math.max(...picture.blocks) > 30, 'the picture is dark');
  await button('Step forward').click();
  await eventually(async () => (await timeOnServer()) === 1, 'the step did not arrive');
  await steadyPicture(page, 2);
});

test('nothing went wrong in the page meanwhile', () => assert.deepEqual(faults, []));
