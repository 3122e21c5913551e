// What limits the hand, in the headset: each cause has its pattern, patterns differ by what a person tells apart, and a
// pattern comes whole.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import test from 'node:test';
import {module} from './modules.mjs';

const {CauseSignal, patternOf} = await module('causes.js');
const {Headset} = await module('headset.js');
const texts = JSON.parse(readFileSync(new URL('../../texts.en.json', import.meta.url), 'utf8'));
const kOfTheLine = ['limit.title', 'limit.title_title', 'limit.none', 'limit.more', 'limit.more_title'];
const kLimits = Object.keys(texts).filter(key => key.startsWith('limit.') && !kOfTheLine.includes(key));
const lasts_ms = ({pulses}) => pulses.reduce((sum, one) => sum + one.on_ms + one.off_ms, 0);

// Runs for so long with a cause, a frame every `frame_ms`: what was played, and when no closeness may be felt.
function run(signal, played, cause, {from_ms, for_ms, frame_ms = 11}) {
  const busy = [];
  for (let now = from_ms; now < from_ms + for_ms; now += frame_ms) {
    signal.now = now;
    if (signal.step(now, cause)) busy.push(now);
  }
  return {played: played.splice(0), busy};
}
function begin() {
  const played = [],
    signal = new CauseSignal(one => played.push({...one, at_ms: signal.now}));
  return {signal, played};
}

test('every limit that the viewer tells has a pattern; what is none has none', () => {
  assert.ok(kLimits.length >= 12);
  for (const key of kLimits) assert.ok(patternOf(key), key);
  assert.equal(patternOf('limit.none'), null);
  assert.equal(patternOf('toString'), null);
});

test('patterns of different causes differ by length, pitch or number, none is longer than 2.5 s, and none has more than four pulses to count', () => {
  const patterns = [...new Map(kLimits.map(key => [JSON.stringify(patternOf(key).pulses), patternOf(key)])).values()];
  const names = new Set(patterns.map(({family, count}) => family + count));
  assert.equal(names.size, patterns.length);
  for (const pattern of patterns) {
    assert.ok(pattern.count <= 4 && lasts_ms(pattern) <= 2500, JSON.stringify(pattern));
    for (const {on_ms, off_ms, strength, tone_Hz} of pattern.pulses) {
      assert.ok(on_ms >= 80 && off_ms >= 50, 'motors and skin resolve it');
      assert.ok(strength >= 0.5 && strength <= 1 && tone_Hz >= 200 && tone_Hz <= 1000);
    }
  }
  const of = family => patterns.find(pattern => pattern.family === family).pulses;
  const [long] = of('follows'),
    [short] = of('farther'),
    [first, second] = of('felt');
  assert.ok(long.on_ms >= 3 * short.on_ms && second.on_ms >= 3 * first.on_ms, 'long and short are told apart');
  const pitches = [long, short, first].map(one => one.tone_Hz).sort((a, b) => a - b);
  assert.ok(pitches[1] / pitches[0] >= 1.5 && pitches[2] / pitches[1] >= 1.5, 'by a fifth or more');
});

test('a pattern comes whole and in order, with silence round it, and again while its cause stands', () => {
  const {signal, played} = begin(),
    {pulses} = patternOf('limit.master_switch');
  const {played: first, busy} = run(signal, played, 'limit.master_switch', {from_ms: 1000, for_ms: 3000});
  assert.deepEqual(
    first.map(one => one.on_ms),
    pulses.map(one => one.on_ms),
  );
  assert.ok(first[0].at_ms - 1000 >= 140, 'the closeness is silent before it');
  first.slice(1).forEach((one, i) => assert.ok(one.at_ms - first[i].at_ms >= first[i].on_ms + first[i].off_ms));
  assert.ok(busy.at(-1) - first.at(-1).at_ms >= first.at(-1).on_ms + 100, 'and after it');
  const later = run(signal, played, 'limit.master_switch', {from_ms: 4000, for_ms: 3500});
  assert.equal(later.played.length, pulses.length, 'once more in seven seconds');
});

test('slow frames delay pulses and leave none out', () => {
  const {signal, played} = begin();
  const slow = run(signal, played, 'limit.alignment', {from_ms: 0, for_ms: 3900, frame_ms: 700});
  assert.equal(slow.played.length, 4);
});

test('a guard that flickers is not told, one that stands is; a graver cause comes after the pattern that is being told', () => {
  const {signal, played} = begin();
  for (let now = 0; now < 4000; now += 300) {
    assert.deepEqual(run(signal, played, 'limit.percept', {from_ms: now, for_ms: 200}).played, []);
    assert.deepEqual(run(signal, played, null, {from_ms: now + 200, for_ms: 100}).played, []);
  }
  run(signal, played, null, {from_ms: 4200, for_ms: 100});
  assert.equal(run(signal, played, 'limit.percept', {from_ms: 5000, for_ms: 900}).played.length, 2, 'short, then long');
  const stop = run(signal, played, 'limit.stopped', {from_ms: 5900, for_ms: 1200}).played;
  assert.deepEqual(
    stop.map(one => one.on_ms),
    patternOf('limit.stopped').pulses.map(one => one.on_ms),
  );
  assert.equal(
    run(signal, played, 'limit.damped', {from_ms: 7100, for_ms: 3000}).played.length,
    0,
    'the same pattern too soon after',
  );
});

test('what is not known is not told', () => {
  const {signal, played} = begin();
  assert.deepEqual(run(signal, played, null, {from_ms: 0, for_ms: 9000}), {played: [], busy: []});
});

test('while a cause is told the controllers do not vibrate by closeness', t => {
  const pulses = [],
    source = {gamepad: {hapticActuators: [{pulse: (strength, ms) => pulses.push([strength, ms])}]}};
  let now = 1000;
  t.mock.method(performance, 'now', () => now);
  const headset = {felt_ms: -Infinity, session: {inputSources: [source]}, vibrate: Headset.prototype.vibrate};
  headset.causes = new CauseSignal(one => headset.vibrate(one.strength, one.on_ms));
  const feel = cause => {
    now += 40;
    Headset.prototype.feel.call(headset, {known: true, closeness: 0.3, cause});
  };
  feel(null);
  assert.deepEqual(
    pulses.splice(0).map(([strength]) => strength),
    [0.3],
  );
  for (let i = 0; i < 15; ++i) feel('limit.stopped');
  assert.deepEqual(pulses.splice(0), [[1, 360]]);
  for (let i = 0; i < 15; ++i) feel(null);
  assert.ok(pulses.length > 2 && pulses.every(([strength]) => strength === 0.3));
});
