// The stream of numbers and scene: how old what comes is, what is known of the state, when it stands still, and how it is opened again.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Page} from './browser.mjs';

// A message that tells the time: of poses (1), or of a scene that stands still (3).
function timed(kind, time_s = 0, octets = 16) {
  const data = new DataView(new ArrayBuffer(octets));
  data.setUint8(0, kind);
  if (octets >= 16) data.setFloat64(8, time_s, true);
  return data.buffer;
}

// A stream, and what it says of itself.
function begin() {
  const page = new Page(['stream.js']);
  page.run(`globalThis.seen = []; globalThis.stream = new Stream('ws://viewer/scene', {
    state: state => seen.push(['state', state.n]), heard: () => undefined, closed: code => seen.push(['closed', code]), still: still => seen.push(['still', still]) });
    stream.start()`);
  return Object.assign(page, {
    stream: page.run('stream'),
    socket: () => page.window.sockets.at(-1),
    seen: () => page.value('seen.splice(0)'),
  });
}
// Lets messages come as the viewer sends them, for a while.
async function alive(page, ms, kind = 3) {
  for (const until_ms = page.clock.now_ms + ms; page.clock.now_ms < until_ms; await page.clock.advance(200))
    page.socket().hear(timed(kind, page.clock.now_ms / 1000));
}

test('a state is what was told first with what was told of it since', () => {
  const merged = (state, message) =>
    JSON.parse(
      new Page(['stream.js']).run(`JSON.stringify(merged(${JSON.stringify(state)}, ${JSON.stringify(message)}))`),
    );
  assert.deepEqual(merged({a: 1, link: {x: 1, y: 2}}, {type: 'state', link: {y: 3}}), {a: 1, link: {x: 1, y: 3}});
  assert.deepEqual(merged({list: [1, 2, 3]}, {list: [4]}), {list: [4]}, 'lists come whole');
  assert.deepEqual(merged({hits: {1: {t: 1}}}, {hits: {2: {t: 2}}}), {hits: {1: {t: 1}, 2: {t: 2}}});
  assert.deepEqual(merged({gripper: {width_m: 1}}, {gripper: null}), {gripper: null});
  assert.deepEqual(merged({gripper: null}, {gripper: {width_m: 1}}), {gripper: {width_m: 1}});
  assert.deepEqual(
    merged({components: {a: 1}}, {components: {}}),
    {components: {}},
    'an object of nothing is all there is',
  );
});

test('the age of what comes is measured by the sample that was on its way for the shortest time', () => {
  const {run} = Object.assign(
    {},
    {run: expression => new Page(['stream.js']).run(`(() => { const clock = new ClockOffset(); ${expression} })()`)},
  );
  assert.equal(run('clock.heard(5, 105); return clock.age_s(5, 105)'), null, 'no round trip is known yet');
  assert.equal(run('clock.echoed(0.01); return clock.age_s(5, 105)'), null, 'no time has come yet');
  // Theirs is 100 s behind ours; the way takes 5 ms at least, and now and then 45 ms.
  const ways =
    'clock.echoed(0.05); clock.echoed(0.01); for (let i = 0; i < 50; ++i) clock.heard(i, 100 + i + (i % 10 === 5 ? 0.005 : 0.045));';
  assert.ok(Math.abs(run(ways + 'return clock.age_s(49, 149.045)') - 0.045) < 1e-9);
  assert.ok(run(ways + 'return clock.samples.length') <= 6, 'what cannot become the shortest is not kept');
  assert.ok(
    Math.abs(run(ways + 'clock.heard(100, 200.2); return clock.age_s(100, 200.2)') - 0.005) < 1e-9,
    'after 20 s only what came since counts',
  );
});

test('a scene that is drawn is asked for once the socket is open, and given up likewise', () => {
  const page = begin(),
    scene = {text() {}, binary() {}, still() {}};
  page.stream.draw(scene);
  assert.deepEqual(page.socket().sent, []);
  page.socket().open();
  const asked = () =>
    page
      .socket()
      .sent.splice(0)
      .map(one => JSON.parse(one))
      .filter(one => 'rate_Hz' in one);
  assert.deepEqual(asked(), [{rate_Hz: 120}]);
  page.stream.draw(scene);
  assert.deepEqual(asked(), []);
  page.stream.draw(null);
  assert.deepEqual(asked(), [{rate_Hz: 0}]);
});

test('what comes goes where it belongs', () => {
  const page = begin(),
    texts = [],
    buffers = [],
    hands = [];
  page.socket().open();
  page.socket().hear({type: 'hand', state: 'free'});
  page.stream.lead({take: message => hands.push(message.state), lost: () => hands.push('lost')});
  page.stream.draw({
    text: message => texts.push(message.type),
    binary: buffer => buffers.push(buffer.byteLength),
    still() {},
  });
  page.socket().hear({type: 'state', n: 1});
  page.socket().hear({type: 'cell'});
  page.socket().hear({type: 'hand', state: 'leads'});
  page.socket().hear(timed(1, 0, 40));
  page.socket().hear(timed(2, 0, 4));
  assert.deepEqual(
    page.seen().filter(([what]) => what === 'state'),
    [['state', 1]],
  );
  assert.deepEqual(texts, ['cell']);
  assert.deepEqual(buffers, [40, 4]);
  assert.deepEqual(hands, ['free', 'leads'], 'who leads later hears what was said before');
  page.socket().end(1006);
  assert.equal(hands.at(-1), 'lost');
});

test('the state of a new connection is not that of the one before', async () => {
  const page = begin();
  page.socket().open();
  page.socket().hear({type: 'state', n: 1, old: true});
  page.socket().end(1006);
  await page.clock.advance(300);
  page.socket().open();
  page.socket().hear({type: 'state', n: 2});
  assert.deepEqual(page.value('stream.state'), {n: 2});
});

test('it stands still 440 ms after the last message that tells the time, and is heard again with the next', async () => {
  const page = begin();
  page.socket().open();
  for (const kind of [1, 3]) {
    await alive(page, 3000, kind);
    assert.deepEqual(page.seen(), []);
  }
  const last_ms = page.clock.now_ms;
  page.socket().hear(timed(3));
  await page.clock.advance(430);
  page.socket().hear({type: 'state', n: 1}); // tells no time
  page.socket().hear(timed(2));
  page.socket().hear(timed(1, 0, 8));
  page.seen();
  await page.clock.advance(20);
  assert.deepEqual(page.seen(), [['still', true]]);
  assert.ok(page.clock.now_ms - last_ms <= 500, 'half a second, drawing included');
  page.socket().hear(timed(3));
  assert.deepEqual(page.seen(), [['still', false]]);
});

test('a browser that was busy reads what waits before it says that the stream stands still', async () => {
  const page = begin();
  page.socket().open();
  page.socket().hear(timed(3));
  page.clock.stall(2000);
  await page.clock.advance(50); // the timer comes late; what waits in the socket has not been read
  assert.deepEqual(page.seen(), []);
  page.socket().hear(timed(3));
  await page.clock.advance(430);
  assert.deepEqual(page.seen(), []);
  await page.clock.advance(20);
  assert.deepEqual(page.seen(), [['still', true]]);
});

test('a browser that is always busy shows that in the end', async () => {
  const page = begin();
  page.socket().open();
  page.socket().hear(timed(3));
  let readings = 0;
  for (; readings < 20 && !page.stream.still; ++readings) {
    page.clock.stall(700);
    await page.clock.advance(0);
  }
  assert.ok(page.stream.still);
  assert.ok(readings > 4 && readings <= 7, `${readings} readings`);
});

test('it is opened again after 250 ms, each time after twice as long, 4 s at most; and soon again once something came', async () => {
  const page = begin(),
    waits = [];
  for (let tries = 0; tries < 7; ++tries) {
    const count = page.window.sockets.length,
      begun_ms = page.clock.now_ms;
    page.socket().end(1006);
    while (page.window.sockets.length === count) await page.clock.advance(50);
    waits.push(page.clock.now_ms - begun_ms);
  }
  assert.deepEqual(waits, [250, 500, 1000, 2000, 4000, 4000, 4000]);
  assert.deepEqual(page.seen(), [['still', true], ...Array(7).fill(['closed', 1006])]);
  page.socket().open();
  page.socket().hear({type: 'state', n: 1});
  page.socket().end(4001);
  assert.deepEqual(page.seen().at(-1), ['closed', 4001], 'with the reason');
  const count = page.window.sockets.length;
  await page.clock.advance(250);
  assert.equal(page.window.sockets.length, count + 1);
});

test('hurry opens it at once while it waits, and no second one beside it', async () => {
  const page = begin();
  page.stream.hurry();
  assert.equal(page.window.sockets.length, 1);
  for (let i = 0; i < 4; ++i) {
    page.socket().end(1006);
    await page.clock.advance(4000);
  }
  page.socket().end(1006);
  const count = page.window.sockets.length;
  page.stream.hurry();
  assert.equal(page.window.sockets.length, count + 1);
  page.socket().open();
  await alive(page, 5000);
  assert.equal(page.window.sockets.length, count + 1, 'the row of tries has ended');
});

test('a connection of which nothing comes for ten seconds is given up for another', async () => {
  const page = begin();
  const [first] = page.window.sockets;
  await page.clock.advance(9900);
  assert.equal(page.window.sockets.length, 1);
  await page.clock.advance(200);
  assert.equal(page.window.sockets.length, 2, 'it never opened');
  assert.equal(first.readyState, 3);
  page.socket().open();
  page.socket().hear(timed(3));
  await page.clock.advance(10_600);
  assert.equal(page.window.sockets.length, 3, 'its host may be gone');
  page.seen();
  first.hear(timed(3));
  first.onclose({code: 1006});
  assert.deepEqual(page.seen(), [], 'what comes of it afterwards counts for nothing');
});

test('a page that stops following tries no more', async () => {
  const page = begin();
  page.socket().open();
  page.stream.stop();
  await page.clock.advance(60_000);
  assert.equal(page.window.sockets.length, 1);
  assert.equal(page.stream.open, false);
});

test('only an echo that comes before the next is asked for tells a round trip', async () => {
  const page = begin();
  page.socket().open();
  const asked = () => JSON.parse(page.socket().sent.at(-1)).echo,
    trip = () => page.stream.clock.leastRoundTrip_s;
  const late = asked();
  await alive(page, 1400);
  assert.notEqual(asked(), late);
  page.socket().hear({type: 'echo', echo: late});
  page.socket().hear({type: 'echo', echo: 99});
  assert.equal(trip(), null);
  await alive(page, 800); // until another has been asked for
  const begun_ms = page.clock.now_ms,
    prompt = asked();
  while (asked() === prompt) await page.clock.advance(10);
  assert.ok(page.clock.now_ms - begun_ms <= 1000);
  await page.clock.advance(20);
  page.socket().hear({type: 'echo', echo: asked()});
  assert.ok(trip() >= 0.02 && trip() < 0.031);
});

test('what is sent is dropped while more waits than the socket takes', () => {
  const page = begin();
  assert.equal(page.stream.send('x'), false, 'it is not open');
  page.socket().open();
  assert.equal(page.stream.send('x'), true);
  page.socket().bufferedAmount = 1025;
  assert.equal(page.stream.send('y'), false);
  assert.ok(page.socket().sent.includes('x') && !page.socket().sent.includes('y'));
});
