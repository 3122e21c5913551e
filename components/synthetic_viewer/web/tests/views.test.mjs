// The views: which streams the page follows, and how pointers and keys turn them.
import assert from 'node:assert/strict';
import test from 'node:test';
import {aState, kPageScripts, Page} from './browser.mjs';

async function open({change = {}, answers = {}} = {}) {
  const page = new Page(kPageScripts, {
    answers: {
      session: () => [200, {secrets: false, role: null}],
      view: () => [200, {ok: true, message: ''}],
      command: () => [200, {ok: true, message: ''}],
      ...answers,
    },
  });
  for (const view of ['main-view', 'hit-view', 'tool-view', 'camera-view']) page.byId(view).clientHeight = 360;
  await page.clock.advance(5);
  const [socket] = page.window.sockets;
  socket.open();
  page.hear = message => socket.hear({type: 'state', ...message});
  page.hear({...aState(), ...change});
  return page;
}
const close = (a, b) => Math.abs(a - b) < 1e-9;
const stream = (page, id) => page.byId(id).dataset.stream || '';

test('movements that come before the last is answered are one request', async () => {
  let answer;
  const page = await open({
    answers: {
      view: () =>
        new Promise(resolve => {
          answer = () => resolve([200, {ok: true, message: ''}]);
        }),
    },
  });
  const turn = orbit_deg => page.run(`moveView({ view: 'main', orbit_deg: ${JSON.stringify(orbit_deg)} })`);
  turn([1, 0]);
  for (let i = 0; i < 30; ++i) turn([10, -1]);
  page.run(
    "moveView({ view: 'main', zoom: 0.5 }); moveView({ view: 'main', zoom: 0.5 }); moveView({ view: 'hit', zoom: 2 })",
  );
  await page.clock.advance(5);
  assert.deepEqual(page.posted('view'), [{view: 'main', orbit_deg: [1, 0], zoom: 1}]);
  answer();
  await page.clock.advance(5);
  assert.deepEqual(page.posted('view')[1], {view: 'main', orbit_deg: [180, -30], zoom: 0.25}, 'half a turn at most');
  answer();
  await page.clock.advance(5);
  assert.deepEqual(page.posted('view')[2], {view: 'hit', orbit_deg: [0, 0], zoom: 2});
});

test('going home forgets the movements that wait, and zoom has its bounds', async () => {
  let answer;
  const page = await open({
    answers: {
      view: () =>
        new Promise(resolve => {
          answer = () => resolve([200, {ok: true, message: ''}]);
        }),
    },
  });
  page.run(
    "moveView({ view: 'main', zoom: 2 }); moveView({ view: 'main', orbit_deg: [5, 5] }); moveView({ view: 'main', home: true })",
  );
  await page.clock.advance(1);
  answer();
  await page.clock.advance(1);
  assert.deepEqual(page.posted('view')[1], {view: 'main', home: true, orbit_deg: [0, 0], zoom: 1});
  answer();
  await page.clock.advance(1);
  page.run("moveView({ view: 'main', zoom: 2 }); for (let i = 0; i < 99; ++i) moveView({ view: 'main', zoom: 2 })");
  await page.clock.advance(1);
  answer();
  await page.clock.advance(1);
  assert.equal(page.posted('view').at(-1).zoom, 10);
});

test('one pointer turns a view by its way, and the wheel zooms', async () => {
  const page = await open(),
    image = page.byId('main-view');
  page.point('pointerdown', image, {clientX: 100, clientY: 100, button: 2});
  page.point('pointermove', image, {clientX: 180, clientY: 140});
  await page.clock.advance(1);
  assert.deepEqual(page.posted('view'), [], 'only the first button');
  page.point('pointerdown', image, {clientX: 100, clientY: 100});
  assert.equal(page.document.activeElement, image, 'whose keys turn it, too');
  page.point('pointermove', image, {clientX: 180, clientY: 140});
  page.point('pointermove', image, {clientX: 10, clientY: 10, pointerId: 2});
  await page.clock.advance(1);
  assert.deepEqual(
    page.posted('view'),
    [{view: 'main', orbit_deg: [-40, 20], zoom: 1}],
    'the height of a view is half a turn',
  );
  page.point('pointerup', image);
  page.point('pointermove', image, {clientX: 300, clientY: 300});
  await page.clock.advance(1);
  assert.equal(page.posted('view').length, 1);
  const wheel = page.point('wheel', image, {deltaY: -100});
  await page.clock.advance(1);
  assert.ok(wheel.defaultPrevented);
  assert.ok(close(page.posted('view').at(-1).zoom, 0.9));
});

test('two fingers zoom by their distance and turn by their middle; a double tap brings the view home', async () => {
  const page = await open(),
    image = page.byId('main-view'),
    finger = (type, pointerId, clientX, clientY) =>
      page.point(type, image, {pointerType: 'touch', pointerId, clientX, clientY});
  finger('pointerdown', 1, 100, 100);
  finger('pointerdown', 2, 200, 100);
  finger('pointermove', 2, 300, 100);
  await page.clock.advance(1);
  const [{orbit_deg, zoom}] = page.posted('view');
  assert.ok(close(zoom, 0.5) && close(orbit_deg[0], -25) && orbit_deg[1] === 0);
  finger('pointerup', 1, 100, 100);
  finger('pointerup', 2, 300, 100);
  const tap = async wait_ms => {
    await page.clock.advance(wait_ms);
    finger('pointerdown', 3, 50, 50);
    finger('pointerup', 3, 50, 50);
  };
  const homes = () => page.posted('view').filter(one => one.home).length;
  await tap(500);
  await tap(500);
  await page.clock.advance(1);
  assert.equal(homes(), 0, 'two taps that are far apart');
  await tap(100);
  await page.clock.advance(1);
  assert.equal(homes(), 1);
});

test('the keys of a view turn, zoom and bring it home', async () => {
  const page = await open();
  page.byId('hit-view').focus();
  for (const key of ['ArrowLeft', 'ArrowUp', '+', '-', 'Home']) {
    assert.ok(page.press(key).defaultPrevented);
    await page.clock.advance(1);
  }
  assert.equal(page.press('x').defaultPrevented, false);
  const posted = page.posted('view');
  assert.deepEqual(
    posted.map(one => one.orbit_deg),
    [
      [-5, 0],
      [0, 5],
      [0, 0],
      [0, 0],
      [0, 0],
    ],
  );
  assert.ok(close(posted[2].zoom, 0.9) && close(posted[3].zoom, 1 / 0.9) && posted[4].home);
  assert.ok(posted.every(one => one.view === 'hit'));
});

test('only views that are there are followed: the zone while it threatens, the tool and the camera where there are any', async () => {
  const page = await open();
  assert.deepEqual(
    ['main-view', 'hit-view', 'tool-view', 'camera-view'].map(id => stream(page, id)),
    ['stream/main', '', 'stream/tool', ''],
  );
  assert.equal(page.text('hit-empty'), 'No hit threatens. When one does, its zone appears here.');
  page.hear({view: {alert: 3, threatening: true, node: 'N'}, viewer: {camera: 'gate', tool_view: false}});
  assert.deepEqual(
    ['hit-view', 'tool-view', 'camera-view'].map(id => stream(page, id)),
    ['stream/hit', '', 'stream/camera'],
  );
  assert.equal(page.text('hit-caption'), 'Alert 3, from above');
  assert.ok(
    page.byId('hit-figure').classList.contains('threat') &&
      !page.byId('hit-view').hidden &&
      page.byId('tool-figure').hidden,
  );
  page.hear({view: {threatening: false}});
  assert.equal(page.text('hit-caption'), 'Alert 3, from above, over');
  page.hear({
    view: {alert: 0},
    hits: {1: {number: 1, alert: 3, cleared_after_s: 1, t: 1, rule: 'very_close', link: '', object: '', speed_m_s: 0}},
    total_hits: 1,
  });
  assert.equal(page.text('hit-caption'), 'Alert 3, over: first picture');
  assert.match(page.byId('hit-view').src, /hits\/3\.jpg$/);
  page.hear({link: {views_enabled: false}});
  assert.equal(page.text('hit-caption'), 'Hit zone: views are off');
  assert.ok(page.byId('hit-view').hidden);
});

test('a stream that breaks is followed again after two seconds; after three it says that there is no picture', async () => {
  const page = await open(),
    image = page.byId('main-view');
  page.point('error', image);
  page.hear({});
  assert.equal(stream(page, 'main-view'), '');
  await page.clock.advance(2100);
  page.hear({});
  assert.equal(stream(page, 'main-view'), 'stream/main');
  assert.match(image.src, /^http:\/\/viewer:8081\/stream\/main\?\d+$/);
  await page.clock.advance(3100);
  page.hear({});
  assert.match(page.text('main-note'), /^No live picture: this browser follows six streams/);
  image.naturalWidth = 640;
  page.hear({});
  assert.equal(page.text('main-note'), 'Cell: drag to turn, wheel or two fingers to zoom');
});

test('a view that is drawn here needs no stream', async () => {
  const page = await open();
  page.run("operatorPage.drawn.add('main'); operatorPage.refresh()");
  assert.equal(stream(page, 'main-view'), '');
  assert.equal(stream(page, 'tool-view'), 'stream/tool');
});

test('the buttons of a view bring it home once it was moved, and record it', async () => {
  const page = await open(),
    tools = page.document.querySelector('[data-tools=main]'),
    home = tools.querySelector('.home'),
    record = tools.querySelector('.record');
  assert.ok(home.hidden);
  page.hear({view: {moved: {main: true, hit: false, tool: false}}});
  assert.equal(home.hidden, false);
  home.click();
  await page.clock.advance(1);
  assert.ok(page.posted('view')[0].home);
  record.click();
  await page.clock.advance(1);
  assert.equal(page.posted('view')[1].record, true);
  page.hear({recording: {running: true, view: 'main', file: '/data/main.mp4', problem: ''}});
  assert.equal(record.getAttribute('aria-pressed'), 'true');
  assert.equal(page.text('main-note'), 'Recording to main.mp4');
  record.click();
  await page.clock.advance(1);
  assert.equal(page.posted('view')[2].record, false);
  page.hear({recording: {problem: 'the disk is full'}});
  assert.equal(page.text('main-note'), 'Recording: the disk is full');
});

test('G asks for the way from the tool to the nearest object, and ends that; its gap is told beside the view', async () => {
  const page = await open();
  page.press('g');
  await page.clock.advance(1);
  assert.equal(page.posted('view').at(-1).approach, true);
  const gap = {gap_m: 0.0342, object_words: {key: 'object.named', values: {name: 'pump'}}};
  page.hear({view: {alert: 4294967295, approach: true, gap}});
  assert.equal(page.text('hit-caption'), 'pump: gap 34 mm');
  assert.equal(page.byId('approach').getAttribute('aria-pressed'), 'true');
  assert.equal(stream(page, 'hit-view'), 'stream/hit');
  assert.ok(!page.byId('hit-figure').classList.contains('threat'));
  page.byId('approach').click();
  await page.clock.advance(1);
  assert.equal(page.posted('view').at(-1).approach, false);
});
