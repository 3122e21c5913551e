// A recording on the page: its time line, its keys, and that of many wishes only the newest is asked for. Its plots: the numbers on their axes.
import assert from 'node:assert/strict';
import test from 'node:test';
import {aState, kPageScripts, Page} from './browser.mjs';

const kLeft = 46,
  kRight = 8,
  kWidth = 1054; // 1000 px of time
const kEntered_s = 0.02;
const mark = (alert, t, cleared_t = t + 1) => ({
  alert,
  t,
  cleared_t,
  rule: 'very_close',
  link: 'hand',
  object: 'upright',
  interest_point: '',
  speed_m_s: 0.25,
});
const kFacts = {
  begin_utc_ms: Date.UTC(2026, 0, 2, 3, 4, 5),
  duration_s: 20,
  alerts: [mark(1, 4), mark(2, 9), mark(3, 15, null)],
  problems: [],
  link_states: [],
  series: [
    {name: 'closeness', label: 'closeness', unit: '', plot: 'closeness'},
    {name: 'slave', label: 'slave', unit: '', plot: 'link'},
  ],
};
const kColumns = {
  from: 0,
  to: 20,
  series: {closeness: {least: [0, null], greatest: [0.5, null]}, slave: {least: [3, 3], greatest: [3, 5]}},
};

// A 2D context that keeps what is written and filled.
function paper() {
  const kept = {texts: [], boxes: [], cleared: 0};
  const g = {
    fillText: (text, x, y) => kept.texts.push([text, x, y]),
    fillRect: (...box) => kept.boxes.push([g.fillStyle, ...box]),
    clearRect: () => ++kept.cleared,
    measureText: text => ({width: 6 * text.length}),
  };
  for (const act of [
    'setTransform',
    'beginPath',
    'moveTo',
    'lineTo',
    'fill',
    'stroke',
    'save',
    'restore',
    'rect',
    'clip',
  ])
    g[act] = () => undefined;
  return {g, kept};
}

// A page of a recording at `t`, whose viewer answers what is asked of it.
async function open({t = 0, answers = {}, change = {}, facts = kFacts} = {}) {
  const page = new Page([...kPageScripts, 'review_plots.js', 'review.js'], {
    answers: {
      session: () => [200, {secrets: false, role: null}],
      review: ({body}) => [200, body ? {ok: true, message: ''} : facts],
      'review/series': () => [200, kColumns],
      ...answers,
    },
  });
  await page.clock.advance(5);
  const [socket] = page.window.sockets;
  socket.open();
  page.at = (at, more = {}) =>
    socket.hear({type: 'state', review: {t: at, utc_ms: 0, playing: false, rate: 1, ...more}, ...change});
  socket.hear({type: 'state', ...aState(), ...change, review: {t, utc_ms: 0, playing: false, rate: 1}});
  await page.clock.advance(5);
  for (const id of ['review-line', 'review-plots']) {
    const canvas = page.byId(id),
      {g, kept} = paper();
    Object.assign(canvas, {clientWidth: kWidth, clientHeight: 48, getContext: () => g});
    page[id] = kept;
  }
  page.window.resized();
  await page.clock.advance(1);
  page.at(t);
  page.x = time_s => kLeft + (time_s / 20) * (kWidth - kLeft - kRight);
  return page;
}
const asked = page => page.posted('review');
const share = (page, id) =>
  page.byId(id).hidden ? null : +/translateX\((.*)%\)/.exec(page.byId(id).style.transform)[1] / 100;

test('a live page has no time line', async () => {
  const page = new Page([...kPageScripts, 'review_plots.js', 'review.js']);
  await page.clock.advance(5);
  page.window.sockets[0].open();
  page.window.sockets[0].hear({type: 'state', ...aState()});
  await page.clock.advance(5);
  assert.equal(page.byId('review-bar'), null);
  assert.ok(!page.press(' ').defaultPrevented);
});

test('it says that nothing is live, when the recording was made, and what could not be read', async () => {
  const page = await open({facts: {...kFacts, problems: ['a topic is cut off']}});
  assert.equal(
    page.text('review-notice'),
    'Recording of 2026-01-02 03:04:05 UTC. Nothing here is live, and nothing can be commanded.',
  );
  assert.equal(page.text('review-problems'), 'Not everything could be read: a topic is cut off');
  assert.ok(page.document.body.classList.contains('review'));
});

test('keys go from alert to alert, with the percept that each rests on', async () => {
  const page = await open(),
    times = () => asked(page).map(body => body.t);
  for (const [key, alert] of [
    [']', 4],
    ['PageDown', 9],
    [']', 15],
  ]) {
    page.press(key);
    await page.clock.advance(1);
    page.at(alert + kEntered_s);
  }
  assert.deepEqual(times(), [4.02, 9.02, 15.02]);
  page.press(']');
  await page.clock.advance(1);
  assert.equal(times().length, 3, 'there is none after the last');
  page.press('[');
  await page.clock.advance(1);
  assert.equal(times().at(-1), 9.02);
  page.byId('review-previous').click();
  await page.clock.advance(1);
  assert.equal(times().at(-1), 4.02, 'also before the viewer is there');
});

test('the moment, its alert and its place on the lines are told', async () => {
  const page = await open();
  const shown = at => {
    page.at(at);
    return [
      page.text('review-time'),
      page.text('review-alert'),
      page.byId('review-alert').classList.contains('threatening'),
    ];
  };
  assert.deepEqual(shown(1), ['1.00 s of 20.0 s', '3 alerts', false]);
  assert.deepEqual(shown(4.5), [
    '4.50 s of 20.0 s',
    'Alert 1 of 3: #1 at 4.0 s, hand near upright, very close, 0.25 m/s, over after 1.0 s',
    true,
  ]);
  assert.deepEqual(shown(6)[2], false, 'it is over');
  assert.deepEqual(
    shown(19),
    ['19.00 s of 20.0 s', 'Alert 3 of 3: #3 at 15.0 s, hand near upright, very close, 0.25 m/s', true],
    'which never ended',
  );
  assert.equal(page.text('review-clock'), '2026-01-02 03:04:24 UTC');
  for (const id of ['review-line-cursor', 'review-plots-cursor'])
    assert.ok(Math.abs(share(page, id) - 0.95) < 1e-9, id);
  assert.equal(page.byId('review-line').ariaValueNow, '19.00');
  page.byId('review-whole').click();
  const none = await open({facts: {...kFacts, alerts: []}});
  assert.equal(none.text('review-alert'), 'No alerts');
});

test('it plays, stands still, steps and changes its rate by keys', async () => {
  const page = await open({t: 5});
  const press = async (key, fields) => {
    page.press(key, fields);
    await page.clock.advance(1);
    return asked(page).at(-1);
  };
  assert.deepEqual(await press(' '), {play: true});
  page.at(5, {playing: true});
  assert.equal(page.text('review-play'), '❚❚');
  const count = asked(page).length;
  await press(' ', {repeat: true});
  assert.equal(asked(page).length, count, 'a key that is held is pressed once');
  assert.deepEqual(await press(' '), {play: false});
  page.at(5);
  assert.equal(page.text('review-play'), '▶');
  assert.deepEqual(await press('.'), {t: 5.1});
  assert.deepEqual(await press(','), {t: 5});
  assert.deepEqual(await press('<'), {rate: 0.5});
  assert.deepEqual(await press('<'), {rate: 0.2}, 'from the rate that was asked for');
  page.at(5, {rate: 0.2});
  assert.deepEqual(await press('>'), {rate: 0.5});
  for (let i = 0; i < 9; ++i) await press('>');
  assert.deepEqual(asked(page).at(-1), {rate: 10});
  for (let i = 0; i < 9; ++i) await press('<');
  assert.deepEqual(asked(page).at(-1), {rate: 0.1});
});

test('on the time line keys go by seconds, and no farther than the recording goes', async () => {
  const page = await open({t: 5});
  page.byId('review-line').focus();
  const press = async (key, fields) => {
    page.press(key, fields);
    await page.clock.advance(1);
    return asked(page).at(-1);
  };
  assert.deepEqual(await press('ArrowRight'), {t: 6});
  assert.deepEqual(await press('ArrowDown', {shiftKey: true}), {t: 0});
  assert.deepEqual(await press('End'), {t: 20});
  assert.deepEqual(await press('ArrowUp'), {t: 20});
  assert.deepEqual(await press('Home'), {t: 0});
  assert.equal(page.press('ArrowLeft').defaultPrevented, true, 'it turns no view');
});

test('keys that mean something to what has the focus are left to it', async () => {
  const page = await open();
  page.byId('review-next').focus();
  assert.ok(!page.press(' ').defaultPrevented, 'the button is pressed');
  assert.ok(!page.press(']', {ctrlKey: true}).defaultPrevented);
  assert.ok(
    page.press(']', {ctrlKey: true, altKey: true, getModifierState: name => name === 'AltGraph'}).defaultPrevented,
    'which brackets may need',
  );
  assert.ok(!page.press(']', {}, page.byId('gain')).defaultPrevented);
});

test('the pointer goes where it points, and to an alert that it nearly points at', async () => {
  const page = await open(),
    line = page.byId('review-line');
  const point = async (type, time_s, offset_px = 0) => {
    page.point(type, line, {offsetX: page.x(time_s) + offset_px, clientX: 500, clientY: 500});
    await page.clock.advance(1);
  };
  await point('pointerdown', 12.5);
  assert.deepEqual(asked(page), [{t: 12.5}]);
  await point('pointermove', 2);
  assert.deepEqual(asked(page).at(-1), {t: 2});
  line.captured = undefined;
  await point('pointermove', 3);
  assert.deepEqual(asked(page).at(-1), {t: 2}, 'the button is up');
  assert.equal(page.text('review-tip'), '3.00 s');
  await point('pointermove', 9, 3);
  assert.match(page.text('review-tip'), /^#2 at 9\.0 s, hand near upright, very close/);
  assert.ok(!page.byId('review-tip').hidden);
  await point('pointerdown', 9, 3);
  assert.deepEqual(asked(page).at(-1), {t: 9.02});
  await point('pointermove', -5);
  assert.deepEqual(asked(page).at(-1), {t: 0});
  await point('pointerleave', 0);
  assert.ok(page.byId('review-tip').hidden);
});

test('of a scrub only the first and the newest moment are asked for, one after the other, and no plot is drawn', async () => {
  let open_now = 0,
    most = 0;
  const waits = [];
  const page = await open({
    answers: {
      review: ({body}) => {
        if (!body) return [200, kFacts];
        most = Math.max(most, ++open_now);
        return new Promise(resolve =>
          waits.push(() => {
            --open_now;
            resolve([200, {ok: true, message: ''}]);
          }),
        );
      },
    },
  });
  page.window.drawFrames();
  const drawn = page['review-line'].cleared + page['review-plots'].cleared,
    line = page.byId('review-line');
  page.point('pointerdown', line, {offsetX: page.x(4.5), clientX: 0, clientY: 0});
  for (let i = 1; i <= 60; ++i)
    page.point('pointermove', line, {offsetX: page.x(4.5 + 0.2 * i), clientX: 0, clientY: 0});
  await page.clock.advance(1);
  assert.deepEqual(asked(page), [{t: 4.5}]);
  waits.shift()();
  await page.clock.advance(1);
  assert.deepEqual(asked(page), [{t: 4.5}, {t: 16.5}]);
  waits.shift()();
  await page.clock.advance(1);
  assert.equal(most, 1);
  assert.ok(Math.abs(share(page, 'review-line-cursor') - 0.825) < 1e-9, 'the line stands where the pointer is');
  page.at(4.5);
  assert.ok(Math.abs(share(page, 'review-line-cursor') - 0.825) < 1e-9, 'also while the viewer is on its way');
  page.window.drawFrames();
  assert.equal(page['review-line'].cleared + page['review-plots'].cleared, drawn);
  page.at(16.5);
  page.at(3);
  assert.ok(Math.abs(share(page, 'review-line-cursor') - 0.15) < 1e-9, 'once there, the viewer says where it is');
});

test('the stretch of the plots is zoomed about the pointer, within the recording, and asked for once for many turns of the wheel', async () => {
  const waits = [],
    page = await open({
      answers: {'review/series': () => new Promise(resolve => waits.push(() => resolve([200, kColumns])))},
    });
  const series = () =>
    page.window.requests
      .filter(one => one.path.startsWith('review/series'))
      .map(one => Object.fromEntries(new URLSearchParams(one.path.split('?')[1])));
  const plots = page.byId('review-plots'),
    turn = deltaY => page.point('wheel', plots, {deltaY, offsetX: page.x(10)});
  waits.shift()();
  await page.clock.advance(1);
  assert.deepEqual([series()[0].from, series()[0].to], ['0', '20'], 'all of it at first');
  for (let i = 0; i < 20; ++i) turn(-100);
  await page.clock.advance(1);
  assert.equal(series().length, 2);
  waits.shift()();
  await page.clock.advance(1);
  assert.equal(series().length, 3);
  const [, , last] = series();
  assert.ok(Math.abs((+last.from + +last.to) / 2 - 10) < 1e-9 && Math.abs(last.to - last.from - 20 * 0.8 ** 20) < 1e-9);
  assert.deepEqual([last.names, last.columns], ['closeness,slave', '1000']);
  waits.shift()();
  await page.clock.advance(1);
  for (let i = 0; i < 50; ++i) turn(-100);
  await page.clock.advance(1);
  waits.shift()();
  await page.clock.advance(1);
  assert.ok(Math.abs(series().at(-1).to - series().at(-1).from - 0.2) < 1e-9, 'a fifth of a second at least');
  assert.equal(page.byId('review-plots-cursor').hidden, true, 'the moment is beyond');
  waits.shift()();
  await page.clock.advance(1);
  for (let i = 0; i < 99; ++i) turn(100);
  await page.clock.advance(1);
  waits.shift()();
  await page.clock.advance(1);
  assert.deepEqual([series().at(-1).from, series().at(-1).to], ['0', '20']);
});

test('where commands are not allowed its buttons cannot be pressed', async () => {
  const page = await open({change: {viewer: {...aState().viewer, allow_commands: false}}});
  for (const button of page.document.querySelectorAll('#review-bar button')) assert.ok(button.disabled, button.id);
});

test('time lines have round numbers at their places', async () => {
  const page = await open(),
    plots = (duration_s, stretch) => {
      const {g, kept} = paper(),
        canvas = {clientWidth: kWidth, clientHeight: 48, getContext: () => g};
      page.context.drawn = {canvas, facts: {...kFacts, duration_s, alerts: []}, stretch};
      page.run('reviewPlots.drawTimeLine(drawn.canvas, drawn.facts, drawn.stretch)');
      return kept.texts.filter(([text]) => text !== 's');
    };
  assert.deepEqual(
    plots(20, [0, 20]).map(([text]) => text),
    ['0', '2', '4', '6', '8', '10', '12', '14', '16', '18', '20'],
  );
  assert.ok(Math.abs(plots(20, [0, 20])[5][1] - (kLeft + 500)) < 1e-9);
  assert.deepEqual(
    plots(0.5, [0, 0.5]).map(([text]) => text),
    ['0', '0.05', '0.1', '0.15', '0.2', '0.25', '0.3', '0.35', '0.4', '0.45', '0.5'],
  );
  assert.deepEqual(
    plots(125, [0, 1])
      .map(([text]) => text)
      .slice(0, 5),
    ['0', '20', '40', '1:00', '1:20'],
  );
});

test('a plot has an axis of what its curve spans, and what is not known is not drawn', async () => {
  const page = await open();
  page.window.drawFrames();
  const {texts, boxes} = page['review-plots'],
    at = text => texts.find(([one]) => one === text);
  assert.ok(at('Closeness') && at('Link') && at('slave'));
  for (const label of ['0', '1']) assert.ok(at(label), label);
  assert.ok(
    boxes.some(
      ([colour, x, , width]) => colour === '#46a758' && Math.abs(x - kLeft) < 1e-9 && Math.abs(width - 500.5) < 1e-9,
    ),
    'COUPLED for the first half',
  );
  assert.ok(
    boxes.some(([colour, x]) => colour === '#e5484d' && Math.abs(x - kLeft - 500) < 1e-9),
    'STOPPED in the second',
  );
});
