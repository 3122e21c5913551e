// The stop on the page: what is posted until the viewer has taken it, and what the board says meanwhile.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Page} from './browser.mjs';
import {Event} from './document.mjs';

const words = (key, values = {}) => ({key, values});
const kNoStop = {in_force: false, alarm: false, sides: {}, notices: [], notices_words: []};
const stopped = (change = {}) => ({
  in_force: true,
  alarm: false,
  headline: 'EMERGENCY STOP',
  headline_words: words('stop_headline.stopped'),
  notices: [],
  notices_words: [],
  sides: {
    master: {text: '', text_words: words('stop_side.stopped_emergency'), level: 'stopped'},
    slave: {text: '', text_words: words('stop_side.stopped_emergency'), level: 'stopped'},
  },
  ...change,
});

// A page whose viewer answers GET /stop by `page.stops` and POST /command by `page.taken`; either may be null: nobody answers.
async function open(scripts = ['language.js', 'stop.js']) {
  const viewer = {stops: kNoStop, taken: [200, {ok: true, message: 'stopped: master_io, slave_io'}]};
  const given = answer => answer ?? new Promise(() => undefined);
  const page = new Page(scripts, {
    answers: {stop: () => given(page.stops && [200, page.stops]), command: () => given(page.taken)},
  });
  Object.assign(page, viewer);
  page.run('globalThis.told = []; globalThis.say = (text, bad) => told.push([text, bad])'); // page.js's
  await page.clock.advance(1);
  return page;
}
const board = page => ({
  shown: !page.byId('stop-board').hidden,
  alarm: page.byId('stop-board').classList.contains('alarm'),
  headline: page.text('stop-headline'),
  sides: page.byId('stop-sides').hidden ? null : [page.text('stop-master-text'), page.text('stop-slave-text')],
});
const warned = page => page.document.title.includes('STOP NOT CONFIRMED');

test('nothing is shown while no stop is in force, and the state is asked for five times a second', async () => {
  const page = await open();
  assert.equal(board(page).shown, false);
  const before = page.window.requests.length;
  await page.clock.advance(1000);
  assert.equal(page.window.requests.length - before, 5);
  page.document.hidden = true;
  await page.clock.advance(1000);
  assert.equal(page.window.requests.length - before, 5, 'a hidden page asks for nothing');
});

test('the button and Esc stop, once a press, wherever the focus is; Space does not', async () => {
  const page = await open();
  page.byId('stop').click();
  await page.clock.advance(1);
  assert.deepEqual(page.posted('command'), [{kind: 'emergency_stop'}]);
  assert.deepEqual(page.value('told'), [['Emergency stop: stopped: master_io, slave_io', false]]);
  const input = page.byId('gain');
  input.addEventListener('keydown', event => event.stopPropagation());
  const event = page.press('Escape', {}, input);
  await page.clock.advance(1);
  assert.ok(event.defaultPrevented);
  page.press('Escape', {repeat: true}, input);
  page.press(' ');
  await page.clock.advance(1);
  assert.equal(page.posted('command').length, 2);
});

test('the board says what both sides report, each with its level', async () => {
  const page = await open();
  page.stops = stopped({alarm: true, headline_words: words('stop_headline.not_confirmed')});
  Object.assign(page.stops.sides.slave, {text_words: words('stop_side.not_confirmed'), level: 'alarm'});
  await page.clock.advance(300);
  assert.deepEqual(board(page), {
    shown: true,
    alarm: true,
    headline: 'STOP NOT CONFIRMED',
    sides: ['stopped (emergency stop)', 'HAS NOT CONFIRMED THE STOP'],
  });
  assert.equal(page.byId('stop-slave').className, 'side alarm');
  assert.equal(page.byId('stop-master').className, 'side stopped');
  assert.ok(warned(page));
  page.run('speak("de")');
  assert.equal(board(page).headline, 'HALT NICHT BESTÄTIGT');
  page.run('speak("en")');
  page.stops = stopped();
  await page.clock.advance(300);
  assert.deepEqual(board(page), {
    shown: true,
    alarm: false,
    headline: 'EMERGENCY STOP',
    sides: ['stopped (emergency stop)', 'stopped (emergency stop)'],
  });
  assert.ok(!warned(page));
  page.stops = kNoStop;
  await page.clock.advance(300);
  assert.equal(board(page).shown, false);
});

test('a side of which nothing is known is an alarm', async () => {
  const page = await open();
  page.stops = stopped({sides: {slave: stopped().sides.slave}});
  await page.clock.advance(300);
  assert.equal(page.text('stop-master-text'), 'not known');
  assert.equal(page.byId('stop-master').className, 'side alarm');
});

test('a stop that nobody takes is posted again and again, and shouted', async () => {
  const page = await open();
  page.taken = null;
  page.stops = null;
  page.byId('stop').click();
  await page.clock.advance(500);
  assert.deepEqual(board(page), {shown: true, alarm: false, headline: 'STOPPING', sides: null});
  await page.clock.advance(900); // the first try is given up after 1 s
  assert.match(board(page).headline, /^STOP NOT SENT: the viewer does not answer. Use the hardware stop\./);
  assert.ok(board(page).alarm && warned(page));
  await page.clock.advance(4000);
  assert.equal(page.posted('command').length, 5, 'each 1.3 s');
  assert.ok(board(page).alarm);
  page.taken = [200, {ok: true, message: 'stopped'}];
  page.stops = stopped();
  await page.clock.advance(2000);
  assert.equal(board(page).headline, 'EMERGENCY STOP');
  const posted = page.posted('command').length;
  await page.clock.advance(5000);
  assert.equal(page.posted('command').length, posted, 'once it is taken it is not posted again');
});

test('a refused connection is tried again at once, and pressing again starts no second row of tries', async () => {
  const page = await open();
  page.answer('command', () => {
    throw new Error('connection refused');
  });
  page.byId('stop').click();
  await page.clock.advance(100);
  page.byId('stop').click();
  await page.clock.advance(3000);
  const times = page.window.requests.filter(one => one.path === 'command').map(one => one.at_ms);
  assert.ok(times.length >= 10 && times.length <= 12, `${times.length} tries in 3 s`);
});

test('what the viewer refuses is shouted for ten seconds', async () => {
  const page = await open();
  page.taken = [403, {ok: false, message: 'this is a recording'}];
  page.byId('stop').click();
  await page.clock.advance(5);
  assert.equal(board(page).headline, 'STOP NOT SENT: this is a recording. Use the hardware stop.');
  assert.ok(board(page).alarm);
  assert.deepEqual(page.value('told'), [['STOP REFUSED by the viewer: this is a recording', true]]);
  await page.clock.advance(9000);
  assert.ok(board(page).shown);
  await page.clock.advance(1500);
  assert.equal(board(page).shown, false);
  assert.equal(page.posted('command').length, 1);
});

test('a stop that the viewer passed on counts as taken, also without an answer of both sides', async () => {
  for (const status of [409, 504]) {
    const page = await open();
    page.taken = [status, {ok: false, message: 'NOT CONFIRMED by slave_io'}];
    page.byId('stop').click();
    await page.clock.advance(1500);
    assert.equal(page.posted('command').length, 1, status);
    assert.deepEqual(page.value('told'), [['Emergency stop: NOT CONFIRMED by slave_io', true]]);
    assert.equal(board(page).shown, false, 'GET /stop tells the rest');
  }
});

test('an answer of long ago is no state, and the board shows that', async () => {
  const page = await open();
  page.stops = stopped();
  await page.clock.advance(300);
  page.stops = null;
  await page.clock.advance(1900);
  assert.ok(!board(page).alarm);
  await page.clock.advance(1500);
  assert.deepEqual(board(page), {
    shown: true,
    alarm: true,
    headline: 'EMERGENCY STOP, when last heard: the viewer does not answer',
    sides: null,
  });
});

test('what both sides have to be told of is written under the board', async () => {
  const page = await open();
  assert.ok(page.byId('notices').hidden);
  page.stops = {
    ...kNoStop,
    notices: ['two processes send slave_state', 'in English only'],
    notices_words: [words('notice.two_processes', {topic: 'slave_state'}), null],
  };
  await page.clock.advance(300);
  assert.equal(page.byId('notices').hidden, false);
  assert.equal(
    page.text('notices'),
    'two processes send slave_state: only the first is heeded; end one of them\nin English only',
  );
  page.stops = kNoStop;
  await page.clock.advance(300);
  assert.ok(page.byId('notices').hidden);
});

test('without the texts the stop still works, told by keys', async () => {
  const page = await open(['stop.js']);
  page.taken = null;
  page.window.dispatchEvent(new Event('keydown', {key: 'Escape', repeat: false}));
  await page.clock.advance(1100);
  assert.equal(board(page).headline, 'stop.not_sent');
  assert.equal(page.posted('command').length, 1);
});
