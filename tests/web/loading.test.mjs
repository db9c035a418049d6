// SPDX-License-Identifier: Apache-2.0
// While a data set is loaded the page shows how far that is and lets the user cancel it. The load is slow because the
// test holds back the page's request and answers for the server how far it is.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import {
  AxeBuilder,
  difference,
  eventually,
  generateOrbitals,
  launchBrowser,
  sceneOnServer,
  scratchFolder,
  startServer,
  steadyPicture,
  writeSeries,
} from './support.mjs';

const kLoad = { time: 0, stage: 'reading', doneBytes: 1_200_000_000, allBytes: 3_400_000_000 };
const faults = [];
/** The data set that is said to be loading, and whether the request that needs it is held back. */
const slow = { id: undefined };
let server, browser, page;

before(async () => {
  const folder = scratchFolder();
  server = await startServer([generateOrbitals(folder), writeSeries(folder)]);
  browser = await launchBrowser();
  page = await (await browser.newContext({ viewport: { width: 900, height: 560 } })).newPage();
  page.on('pageerror', (error) => faults.push(String(error)));
  await page.route('**/api/v1/datasets', async (route) => {
    const response = await route.fetch();
    const { datasets } = await response.json();
    for (const one of datasets) if (one.id === slow.id) Object.assign(one, { state: 'loading', loading: kLoad });
    await route.fulfill({ response, json: { datasets } });
  });
  await page.route('**/api/v1/sessions', (route) => (slow.id ? undefined : route.continue()));
  await page.routeWebSocket(/\/stream$/, (socket) => {
    const upstream = socket.connectToServer();
    let held = false;
    socket.onMessage((message) => {
      const { type, id, patch } = JSON.parse(message);
      held ||= slow.id !== undefined && patch?.dataset === slow.id; // and all edits and pings behind it
      if (!held || type === 'ack' || (type === 'ping' && id === 0)) upstream.send(message);
    });
  });
});
after(async () => {
  await browser?.close();
  await server?.end();
});

const bar = () => page.getByRole('progressbar');
const cancel = () => page.getByRole('button', { name: 'Cancel' });
const list = () => page.getByRole('region', { name: 'Data set', exact: true });

async function seesTheLoad() {
  await bar().waitFor();
  assert.equal(await bar().getAttribute('aria-valuenow'), '35');
  assert.equal(await bar().getAttribute('aria-valuetext'), '1.2 of 3.4 GB, reading');
  assert.match(await list().getByRole('button', { name: /loading 35 %/ }).textContent(), new RegExp(slow.id));
  const { violations } = await new AxeBuilder({ page }).analyze();
  assert.deepEqual(violations.map(({ id, impact, nodes }) => [id, impact, nodes[0]?.html]), []);
}

test('the first load is shown, and cancelled for the choice of another data set', async () => {
  slow.id = 'orbitals';
  await page.goto(server.url);
  await seesTheLoad();
  await cancel().click();
  const choice = page.getByRole('region', { name: 'Choose a data set' });
  await choice.waitFor();
  slow.id = undefined;
  await choice.getByRole('button', { name: /series/ }).click();
  await steadyPicture(page);
  assert.equal((await sceneOnServer(page)).scene.dataset, 'series');
  assert.equal(await choice.count(), 0);
});

test('a cancelled change of the data set leaves everything as it was', async () => {
  await page.getByRole('button', { name: 'Step forward' }).click();
  await page.locator('.picture').focus();
  for (let i = 0; i < 5; ++i) await page.keyboard.press('ArrowDown');
  const first = await steadyPicture(page);
  const { scene } = await sceneOnServer(page);
  slow.id = 'orbitals';
  await list().getByRole('button', { name: /orbitals/ }).click();
  await seesTheLoad();
  await cancel().click();
  slow.id = undefined;
  await eventually(async () => (await page.locator('.channel').count()) === 1, 'the channels do not come back');
  assert.equal(await bar().count(), 0);
  assert.ok(difference(first, await steadyPicture(page)) < 4, 'the picture is another one');
  assert.deepEqual((await sceneOnServer(page)).scene, scene);
});

test('another data set can be chosen while one is loaded', async () => {
  slow.id = 'orbitals';
  await list().getByRole('button', { name: /orbitals/ }).click();
  await bar().waitFor();
  slow.id = undefined;
  await list().getByRole('button', { name: /orbitals/ }).click(); // again: the same load
  // The next choice is made before the page has heard from the server that this one is undone.
  const late = (route) => setTimeout(() => void route.continue(), 700);
  await page.route('**/api/v1/sessions/*', late);
  await list().getByRole('button', { name: /series/ }).click(); // the one shown before: as Cancel
  await eventually(async () => (await bar().count()) === 0, 'the load is still shown');
  await list().getByRole('button', { name: /orbitals/ }).click();
  await eventually(async () => (await page.locator('.channel').count()) === 4, 'the orbitals are not shown');
  await page.unroute('**/api/v1/sessions/*', late);
  await steadyPicture(page);
});

test('states are asked for only while something is loaded', async () => {
  let asked = 0;
  page.on('request', (request) => (asked += request.url().endsWith('api/v1/datasets')));
  await page.waitForTimeout(1500);
  assert.ok(asked <= 1, `asked ${asked} times`);
});

test('nothing went wrong in the page meanwhile', async () => {
  assert.equal(await page.locator('.toast').count(), 0);
  assert.deepEqual(faults, []);
});
