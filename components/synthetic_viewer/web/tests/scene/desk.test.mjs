// Whose pictures the page shows, and why: the browser's, or the viewer's where the browser cannot draw, draws too few, or by choice.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Storage, Window} from '../browser.mjs';
import {module} from './modules.mjs';

// A desk on a page whose clock a test moves. Its stage is a stand-in: nothing is drawn.
async function open(t, {kept = {}} = {}) {
  const page = new Window(),
    {clock, document} = page;
  for (const name of [
    'document',
    'localStorage',
    'sessionStorage',
    'addEventListener',
    'setTimeout',
    'setInterval',
    'requestAnimationFrame',
    'ResizeObserver',
    'IntersectionObserver',
    'devicePixelRatio',
  ])
    Object.defineProperty(globalThis, name, {value: page[name], configurable: true, writable: true});
  globalThis.localStorage = new Storage(kept);
  t.mock.method(performance, 'now', () => clock.now_ms);
  const {Desk} = await module('desk.js'),
    stream = {
      open: true,
      still: false,
      scenes: [],
      draw: scene => stream.scenes.push(scene),
      lead() {},
      hurry() {},
      send: () => true,
      clock: {age_s: () => 0.01},
    };
  const tools = document.querySelector('[data-tools="main"]'),
    drawn = new Set();
  assert.ok(tools);
  const offered = {
    stream,
    drawn,
    state: () => ({viewer: {frames_per_s: offered.frames_per_s}, link: {slave: 'COUPLED'}}),
    heard: () => clock.now_ms,
    refresh: () => {
      ++offered.refreshed;
    },
    mayOperate: () => true,
    moveView() {},
    refreshed: 0,
    frames_per_s: 5,
  };
  const desk = new Desk(offered),
    shownBy = name => ({
      name,
      drawn: false,
      said: '',
      warned: '',
      show(on) {
        this.drawn = on;
      },
      say(text) {
        this.said = text;
      },
      warn(text) {
        this.warned = text;
      },
    });
  // As after start(), with graphics that draw.
  const begin = () => {
    Object.assign(desk, {
      views: Object.fromEntries(['main', 'hit', 'tool'].map(name => [name, shownBy(name)])),
      cell: {scale: 1, views: {tool: {enabled: true}}},
      fluid: {look() {}},
      view: {main: {note: null}, hit: null},
      stage: {poses: {heard: true, bodies: [], time_s: 1, armAge_s: 0}},
    });
    desk.ages_ms.push(12.4);
    desk.draw = () => undefined;
    desk.follow();
  };
  // So many seconds in which the scene moves 30 times a second and that many pictures are drawn.
  const moves = async (seconds, pictures_per_s) => {
    for (let i = 0; i < 30 * seconds; ++i) {
      clock.now_ms += 1000 / 30;
      desk.pace.moved(clock.now_ms / 1000);
      if (i % Math.round(30 / pictures_per_s) === 0) desk.pace.drew();
      if (i % 8 === 0) {
        desk.judgePace();
        desk.choose();
      }
    }
  };
  return {
    desk,
    page,
    offered,
    stream,
    drawn,
    begin,
    moves,
    clock,
    document,
    source: () => desk.source.textContent,
    followed: () => stream.scenes.at(-1),
  };
}

test("without WebGL the viewer's pictures are shown, and no scene is followed", async t => {
  const {desk, source, followed, drawn} = await open(t);
  globalThis.fetch = async () => ({ok: true, json: async () => ({})});
  await desk.start();
  assert.match(source(), /^scene\.why scene\.no_webgl/);
  assert.equal(followed(), null);
  assert.equal(drawn.size, 0);
});

test("the scene is drawn here once all of it has come, and the page's own streams end", async t => {
  const {desk, begin, drawn, source, offered} = await open(t);
  begin();
  assert.deepEqual([...drawn], ['main', 'hit', 'tool']);
  assert.equal(source(), 'scene.here');
  assert.ok(desk.views.main.drawn && desk.views.tool.drawn && !desk.views.hit.drawn, 'no zone threatens');
  assert.match(desk.views.main.said, /scene\.age 12$/);
  assert.equal(offered.refreshed, 1);
  desk.cell = null;
  desk.choose();
  assert.deepEqual([drawn.size, source()], [0, 'scene.why scene.no_stream']);
});

test("where no scene comes while the page hears the viewer, the viewer's pictures come in its place", async t => {
  const {desk, begin, stream, clock, offered, source} = await open(t);
  begin();
  stream.still = true;
  desk.setStill(true);
  assert.equal(desk.views.main.warned, 'scene.still');
  clock.now_ms += 2000;
  desk.choose();
  assert.equal(source(), 'scene.here');
  clock.now_ms += 600;
  desk.choose();
  assert.equal(source(), 'scene.why scene.no_stream');
  assert.equal(desk.views.main.warned, '', 'they are live');
  stream.still = false;
  desk.setStill(false);
  assert.equal(source(), 'scene.here');
  stream.still = true;
  offered.heard = () => -Infinity;
  clock.now_ms += 10_000;
  desk.choose();
  assert.equal(source(), 'scene.here', 'where the whole viewer is gone, its pictures would not come either');
});

test("a browser that draws too few changes to the viewer's pictures, and stays where these are more", async t => {
  const {desk, begin, moves, followed, source} = await open(t);
  begin();
  await moves(10, 10);
  assert.equal(desk.slow, null);
  await moves(8, 2);
  assert.ok(desk.slow.per_s < 3.5);
  assert.equal(followed(), null);
  assert.match(source(), /^scene\.why scene\.slow/);
  await moves(8, 2);
  assert.ok(desk.tried && desk.slow, "the viewer's are more");
});

test("where the viewer's pictures are even fewer it draws again, and tries no second time", async t => {
  const {desk, begin, moves, followed, offered} = await open(t);
  offered.frames_per_s = 0.1;
  begin();
  await moves(8, 2);
  assert.ok(desk.slow);
  await moves(8, 2);
  assert.ok(desk.tried && !desk.slow && followed() === desk.handlers && desk.shown);
  await moves(20, 2);
  assert.ok(!desk.slow && desk.shown);
});

test("while the page is hidden or hears nothing nothing is judged of the viewer's pictures", async t => {
  const {desk, begin, moves, document, offered} = await open(t);
  offered.frames_per_s = 0.1;
  begin();
  await moves(8, 2);
  document.hidden = true;
  await moves(8, 2);
  assert.ok(!desk.tried && desk.slow);
  document.hidden = false;
  offered.heard = () => -Infinity;
  await moves(8, 2);
  assert.ok(!desk.tried && desk.slow);
});

test('a window that draws nothing is covered, not slow; shown again, the row of looks begins again', async t => {
  const {desk, begin, moves} = await open(t);
  begin();
  await moves(20, 0.001);
  assert.ok(desk.shown && !desk.slow);
  desk.pace.fewLooks = 2;
  desk.follow();
  assert.equal(desk.pace.fewLooks, 0);
});

test("an operator's choice prevails over the pace, and is remembered", async t => {
  const {desk, begin, moves, followed, source} = await open(t);
  begin();
  desk.button.click();
  assert.deepEqual(
    [desk.choice, source(), followed(), desk.button.getAttribute('aria-pressed')],
    ['server', 'scene.server', null, 'true'],
  );
  assert.equal(localStorage.getItem('phantom.pictures'), 'server');
  desk.button.click();
  assert.deepEqual([desk.choice, source(), followed()], ['browser', 'scene.here', desk.handlers]);
  await moves(20, 2);
  assert.ok(desk.pace.few && !desk.slow && desk.shown);
  for (const [choice, shown] of [
    ['browser', true],
    ['server', false],
  ]) {
    const again = await open(t, {kept: {'phantom.pictures': choice}});
    again.begin();
    assert.equal(again.desk.shown, shown, choice);
  }
});

test('graphics that leave the bodies out are not shown, even by choice, until they are looked at again', async t => {
  const {desk, begin, source, followed} = await open(t, {kept: {'phantom.pictures': 'browser'}});
  begin();
  const looked = (...answers) => {
    Object.assign(desk, {looked_ms: -Infinity, whole: null});
    Object.assign(desk.stage, {
      oneByOne: false,
      drawOneByOne() {
        this.oneByOne = true;
      },
      isWhole: () => answers.shift(),
    });
    desk.views.main.shown = true;
    desk.camera = () => ({});
    while (answers.length) {
      desk.checkWhole();
      desk.looked_ms = -Infinity;
    }
    return [desk.whole, desk.stage.oneByOne];
  };
  assert.deepEqual(looked(true), [true, false]);
  assert.deepEqual(looked(null), [null, false]);
  assert.deepEqual(looked(false, true), [true, true], 'drawn one by one they are there');
  assert.deepEqual(looked(false, false), [false, true]);
  assert.deepEqual([source(), followed()], ['scene.why scene.not_whole', null]);
  desk.button.click();
  assert.deepEqual([desk.whole, source(), followed()], [null, 'scene.here', desk.handlers]);
});

test('poses that differ in nothing but number, time and ages draw nothing again', async t => {
  const {desk, begin} = await open(t);
  begin();
  const message = (number, flags, closeness) => {
    const data = new DataView(new ArrayBuffer(36));
    data.setUint8(0, 1);
    data.setUint8(1, flags);
    data.setUint32(4, number, true);
    data.setFloat64(8, number, true);
    data.setFloat32(16, number, true); // its age
    data.setFloat32(28, closeness, true);
    return data.buffer;
  };
  let drawn = 0;
  desk.draw = () => {
    ++drawn;
  };
  desk.stage.setPoses = poses => {
    desk.stage.poses = poses;
  };
  for (const [number, flags, closeness, expected] of [
    [1, 1, 0.5, 1],
    [2, 1, 0.5, 1],
    [3, 3, 0.5, 2],
    [4, 3, 0.25, 3],
    [5, 3, 0.25, 3],
  ]) {
    desk.takeBinary(message(number, flags, closeness));
    assert.equal(drawn, expected, `message ${number}`);
    assert.equal(desk.stage.poses.time_s, number, 'its age is known all the same');
  }
});

test("what the headset's panel says is what is known", async t => {
  const {desk, begin, stream} = await open(t);
  begin();
  desk.hand.take({state: 'ready'});
  desk.view.banner = 'a banner';
  Object.assign(desk.stage.poses, {closeness: 0.6, speed_m_s: 0.1, perceptKnown: true, stale: false});
  assert.deepEqual(desk.facts(), {
    closeness: 0.6,
    speed_m_s: 0.1,
    known: true,
    state: 'link_state.COUPLED',
    hand: 'hand.ready',
    alarm: 'a banner',
    cause: null,
    why: '',
  });
  desk.stage.poses.perceptKnown = false;
  assert.equal(desk.facts().known, false);
  Object.assign(desk.stage.poses, {perceptKnown: true, stale: true});
  assert.equal(desk.facts().state, 'scene.unknown');
  desk.stage.poses.stale = false;
  stream.still = true;
  assert.deepEqual(
    [desk.facts().known, desk.facts().state, desk.facts().alarm],
    [false, 'scene.unknown', 'scene.still'],
  );
  stream.still = false;
  const {state} = desk.page;
  desk.page.state = () => ({...state(), limits_words: ['limit.joint', 'limit.delay'].map(key => ({key, values: {}}))});
  assert.equal(desk.facts().cause, 'limit.joint');
  stream.still = true;
  assert.equal(desk.facts().cause, null, 'what is not heard is not told');
});

test('a camera that was moved here moves that of who may operate, in degrees', async t => {
  const {desk, offered} = await open(t),
    moved = [];
  offered.moveView = request => moved.push(request);
  desk.mirror({name: 'tool', offset: {azimuth_rad: Math.PI, elevation_rad: -Math.PI / 2, zoom: 0.5}});
  assert.deepEqual(moved, [{view: 'tool', home: true, orbit_deg: [180, -90], zoom: 0.5}]);
});

test('who may not choose the node for all chooses it for himself', async t => {
  const {desk, begin, offered} = await open(t);
  begin();
  desk.views.hit.touch = () => undefined;
  const look = (key, fields = {}) => {
    let taken = 0;
    desk.lookFrom({key, preventDefault: () => ++taken, stopPropagation: () => ++taken, ...fields});
    return [desk.node, taken];
  };
  assert.deepEqual(look('t'), [0, 0], "an operator's key is a command");
  offered.mayOperate = () => false;
  assert.deepEqual(
    [look('t'), look('8'), look('x'), look('n', {ctrlKey: true}), look('a')],
    [
      [13, 2],
      [8, 2],
      [8, 0],
      [8, 0],
      [0, 2],
    ],
  );
});

test('meshes are fetched once, and again while something needs one that did not come', async t => {
  const {desk, begin, clock} = await open(t),
    asked = [],
    added = [];
  begin();
  const triangle = new DataView(new ArrayBuffer(8 + 36 + 12));
  triangle.setUint32(0, 3, true);
  triangle.setUint32(4, 1, true);
  triangle.setFloat32(8 + 12, 1, true);
  triangle.setFloat32(8 + 28, 1, true);
  [0, 1, 2].forEach(i => triangle.setUint32(44 + 4 * i, i, true));
  let works = false;
  globalThis.fetch = async path => {
    asked.push(path);
    return {ok: works, status: 404, arrayBuffer: async () => triangle.buffer};
  };
  Object.assign(desk.stage, {
    items: new Map([['a', {mesh: 'k'}]]),
    addMesh: (key, mesh) => added.push([key, mesh.positions.length / 3, mesh.shadow.positions.length / 3]),
    poses: null,
  });
  desk.needMesh('k');
  desk.needMesh('k');
  desk.needMesh(null);
  await clock.settle();
  assert.deepEqual([asked, added], [['mesh/k'], []]);
  works = true;
  await clock.advance(2000);
  assert.deepEqual([asked.length, added], [2, [['k', 3, 3]]]);
  works = false;
  desk.needMesh('k2');
  await clock.advance(5000);
  assert.equal(asked.length, 3, 'nothing needs it any more');
});

test('what the caption below the hit view says does not stand over its picture, too', async t => {
  const {linesOverPicture} = await module('desk.js');
  const before = globalThis.window;
  globalThis.window = {...before, said: words => words.key};
  t.after(() => (globalThis.window = before));
  const left = ['hud.hit', 'hud.alert_over', 'hud.obstructed'].map(key => ({key}));
  assert.deepEqual(linesOverPicture(left), ['hud.obstructed']);
  assert.deepEqual(linesOverPicture([{key: 'hud.approach'}, {key: 'hud.gap'}]), ['hud.approach']);
});
