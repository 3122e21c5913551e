// Where views stand, windows of their own, and the drawers; the stages of delay, and what limits the hand.
import assert from 'node:assert/strict';
import test from 'node:test';
import {aState, kPageScripts, Page} from './browser.mjs';

async function open({change = {}, ...options} = {}) {
  const page = new Page(kPageScripts, {answers: {session: () => [200, {secrets: false, role: null}]}, ...options});
  await page.clock.advance(5);
  const [socket] = page.window.sockets;
  socket.open();
  page.socket = socket;
  page.hear = message => socket.hear({type: 'state', ...message});
  page.hear({...aState(), ...change});
  page.places = () =>
    Object.fromEntries(
      ['main', 'hit', 'tool', 'camera'].map(view => [view, page.byId(view + '-figure').dataset.place]),
    );
  return page;
}
const button = (page, view, name) => page.document.querySelector(`[data-places=${view}] .${name}`);
const kUsual = {main: 'large', hit: 'side1', tool: 'side2', camera: 'none'};

test('each view has its place; one that is not there leaves it to the next', async () => {
  const page = await open();
  assert.deepEqual(page.places(), kUsual);
  page.hear({viewer: {tool_view: false, camera: 'gate'}});
  assert.deepEqual(page.places(), {main: 'large', hit: 'side1', tool: 'none', camera: 'side2'});
});

test('a view is shown large by its button and by X, another time by X the main view again; the browser keeps it', async () => {
  const page = await open();
  button(page, 'tool', 'swap').click();
  assert.deepEqual(page.places(), {main: 'side1', hit: 'side2', tool: 'large', camera: 'none'});
  assert.ok(button(page, 'tool', 'swap').hidden && !button(page, 'main', 'swap').hidden);
  page.byId('hit-view').focus();
  page.press('x');
  assert.equal(page.places().hit, 'large');
  page.press('x');
  assert.deepEqual(page.places(), kUsual);
  button(page, 'tool', 'swap').click();
  const {kept} = page.window.localStorage,
    again = await open({kept});
  assert.equal(again.places().tool, 'large');
  again.hear({viewer: {tool_view: false}});
  assert.equal(again.places().main, 'large', 'a view that is not there cannot be large');
  const spoilt = await open({kept: {'phantom.layout': '{"large":"nothing"'}});
  assert.deepEqual(spoilt.places(), kUsual);
});

test('Z hides the other views and shows them again', async () => {
  const page = await open(),
    enlarged = () => page.byId('desk').classList.contains('enlarged');
  page.press('z');
  assert.ok(enlarged());
  page.hear({});
  assert.deepEqual(
    ['main', 'hit', 'tool'].map(view => page.byId(view + '-view').dataset.stream || ''),
    ['stream/main', '', ''],
    'what is not seen is not followed',
  );
  assert.equal(button(page, 'main', 'enlarge').getAttribute('aria-pressed'), 'true');
  assert.ok((await open({kept: page.window.localStorage.kept})).byId('desk').classList.contains('enlarged'));
  button(page, 'main', 'enlarge').click();
  assert.equal(enlarged(), false);
});

test('a view goes to a window of its own, leaves its place, and comes back when that window goes or falls silent', async () => {
  const page = await open(),
    [channel] = page.window.channels;
  page.byId('hit-view').focus();
  page.press('p');
  assert.deepEqual(page.window.opened, [{address: '?view=hit', name: 'phantom-hit'}]);
  assert.deepEqual(page.places(), {main: 'large', hit: 'none', tool: 'side1', camera: 'none'});
  channel.tell({view: 'hit', gone: false});
  await page.clock.advance(2000);
  assert.equal(page.places().hit, 'none');
  await page.clock.advance(3000);
  assert.deepEqual(page.places(), kUsual, 'silent');
  channel.tell({view: 'tool', gone: false});
  assert.equal(page.places().tool, 'none', 'also one that was opened before this page');
  channel.tell({view: 'tool', gone: true});
  assert.deepEqual(page.places(), kUsual);
  channel.tell({view: 'nothing'});
  const refused = await open({popups: false});
  button(refused, 'hit', 'detach').click();
  assert.deepEqual(refused.places(), kUsual);
  assert.match(refused.text('answer'), /refused a second window/);
});

test('a window of its own shows its view alone, and says that it is there until it goes', async () => {
  const page = await open({search: '?view=tool'}),
    [channel] = page.window.channels;
  assert.ok(page.document.body.classList.contains('alone'));
  assert.deepEqual(
    ['main', 'hit', 'tool'].map(view => page.byId(view + '-view').dataset.stream || ''),
    ['', '', 'stream/tool'],
  );
  assert.deepEqual(page.places(), {main: 'none', hit: 'none', tool: 'large', camera: 'none'});
  assert.ok(button(page, 'tool', 'detach').hidden && button(page, 'tool', 'enlarge').hidden);
  await page.clock.advance(3000);
  assert.ok(channel.sent.length >= 3 && channel.sent.every(({view, gone}) => view === 'tool' && !gone));
  page.point('pagehide', page.window.document);
  assert.equal(channel.sent.at(-1).gone, true);
  assert.equal((await open({search: '?view=nothing'})).document.body.classList.contains('alone'), false);
});

test('a window of its own opens on the other screen, whole, and later where it stood last', async () => {
  const [near, far] = [
    {availLeft: 0, availTop: 0},
    {availLeft: 1920, availTop: 25, availWidth: 2560, availHeight: 1400},
  ];
  const page = await open({screens: {screens: [near, far], currentScreen: near}});
  button(page, 'hit', 'detach').click();
  await page.clock.advance(5);
  assert.deepEqual(page.window.lastOpened.placed, [
    ['move', 1920, 25],
    ['resize', 2560, 1400],
  ]);
  for (const screens of [undefined, 'refused', {screens: [near], currentScreen: near}]) {
    const one = await open({screens});
    button(one, 'hit', 'detach').click();
    await one.clock.advance(5);
    assert.equal(one.window.lastOpened.wants, 'popup,width=1280,height=760');
    assert.deepEqual(one.window.lastOpened.placed, []);
  }
  const own = await open({search: '?view=hit'});
  own.point('pagehide', own.window.document);
  const {kept} = own.window.localStorage,
    again = await open({kept, screens: {screens: [near, far], currentScreen: near}});
  button(again, 'hit', 'detach').click();
  await again.clock.advance(5);
  assert.equal(again.window.lastOpened.wants, 'popup,width=1280,height=720,left=40,top=30');
  assert.deepEqual(again.window.lastOpened.placed, [], 'it stays where the operator had put it');
  const spoilt = await open({kept: {'phantom.window.hit': '{"left":"javascript:"}'}});
  button(spoilt, 'hit', 'detach').click();
  assert.equal(spoilt.window.lastOpened.wants, 'popup,width=1280,height=760');
});

test('one drawer is open at a time; the focus goes into it and back', async () => {
  const page = await open(),
    openOnes = () => ['settings', 'system', 'keys', 'history'].filter(id => !page.byId(id).hidden);
  page.byId('settings-open').click();
  assert.deepEqual(openOnes(), ['settings']);
  assert.equal(page.document.activeElement, page.byId('settings').querySelector('.close'));
  assert.equal(page.byId('settings-open').getAttribute('aria-expanded'), 'true');
  page.press('i');
  assert.deepEqual(openOnes(), ['system']);
  page.press('i');
  assert.deepEqual(openOnes(), []);
  page.byId('hit-view').focus();
  for (const [key, drawer] of [
    ['o', 'settings'],
    ['j', 'history'],
    ['?', 'keys'],
    ['i', 'system'],
  ]) {
    page.press(key, {}, page.byId('hit-view'));
    assert.deepEqual(openOnes(), [drawer]);
  }
  page.byId('system').querySelector('.close').click();
  assert.equal(page.document.activeElement.id, 'hit-view', 'where it came from, also through other drawers');
  page.byId('settings-open').click();
  page.press('o');
  assert.equal(page.document.activeElement.id, 'settings-open');
  assert.deepEqual(openOnes(), []);
});

test('after a stop the reset is asked for beside it', async () => {
  const page = await open();
  page.byId('stop-reset').click();
  assert.ok(!page.byId('settings').hidden && !page.byId('reset-question').hidden);
  assert.equal(page.document.activeElement.id, 'reset-no');
});

test('each stage of delay has its age and its budget, and the one that is over is named', async () => {
  const page = await open({
    change: {
      delay: {
        viewer: {age_s: 0.004, budget_s: 0.25},
        encoder: {age_s: 0.0011, budget_s: 0.002},
        master: {age_s: null, budget_s: 0.02},
        sensing: {age_s: 0.005, budget_s: 0.02},
      },
    },
  });
  const rows = () =>
    page.document
      .querySelectorAll('#delay-stages tr')
      .map(row => [row.className, ...row.children.map(cell => cell.textContent)]);
  assert.deepEqual(rows(), [
    ['', 'Encoders → slave_io', '1.10 ms', '2.00 ms', ''],
    ['', 'slave_io → phantom_sensing', '5.00 ms', '20 ms', ''],
    ['', 'phantom_sensing → master_io', '–', '20 ms', ''],
    ['', 'master_io → viewer', '4.00 ms', '250 ms', ''],
    ['', 'viewer → this page', '–', '250 ms', ''],
  ]);
  assert.equal(page.text('delay'), '10 ms');
  assert.equal(page.text('delay-over'), '');
  page.hear({delay: {sensing: {age_s: 0.035, budget_s: 0.02}}});
  assert.deepEqual(rows()[1], ['over', 'slave_io → phantom_sensing', '35 ms', '20 ms', 'over']);
  assert.equal(page.text('delay-over'), '▲');
  assert.equal(page.byId('delay').title, 'slave_io → phantom_sensing over');
  page.hear({delay: {sensing: {age_s: 0.005, budget_s: 0.02}}});
  assert.equal(rows()[1][2], '35 ms', 'the greatest of two seconds: it can be read');
  page.clock.stall(2100);
  page.hear({});
  assert.equal(rows()[1][2], '5.00 ms');
});

test('the way to this page is measured by the stream, and grows while nothing comes', async () => {
  const page = await open(),
    row = () => page.byId('delay-stages').lastChild.children.map(cell => cell.textContent);
  const alive = there_s => {
    const data = new DataView(new ArrayBuffer(16));
    data.setUint8(0, 3);
    data.setFloat64(8, there_s, true);
    return data.buffer;
  };
  await page.clock.advance(10);
  const echo = JSON.parse(page.socket.sent.at(-1)).echo;
  page.socket.hear({type: 'echo', echo});
  const begin_s = page.clock.now_ms / 1000;
  page.socket.hear(alive(50));
  await page.clock.advance(340);
  page.socket.hear(alive(50 + page.clock.now_ms / 1000 - begin_s - 0.3)); // 0.3 s later than the one before
  page.hear({});
  assert.deepEqual(row().slice(1), ['305 ms', '250 ms', 'over']);
});

test('what limits the hand stands in one line, with how many more, and stays for a moment', async () => {
  const percept = {key: 'limit.percept', values: {gain: 8.16}},
    joint = {key: 'limit.joint', values: {joint: 'j4'}};
  const page = await open({change: {limits_words: [joint, percept]}});
  assert.equal(page.text('why'), 'Joint j4 is at its end: it moves back only.');
  assert.equal(page.text('why-more'), 'and 1 more');
  page.byId('why-more').click();
  assert.ok(!page.byId('why-all').hidden);
  assert.deepEqual(
    page.byId('why-all').children.map(item => item.textContent),
    ['Joint j4 is at its end: it moves back only.', 'A guard of stability holds the drag at gain 8.2.'],
  );
  page.hear({limits_words: null});
  assert.match(page.text('why'), /^Joint j4/);
  page.clock.stall(1100);
  page.hear({limits_words: []});
  assert.equal(page.text('why'), 'nothing holds it back.');
  assert.ok(page.byId('why-more').hidden && page.byId('why-all').hidden);
  page.run("speak('de')");
  assert.equal(page.text('why'), 'nichts hält sie zurück.');
});
