// Whether this browser draws too few pictures.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Pace} from '../../scene/pace.js';

// Returns a pace after `seconds` of so many movements a second, of which every `drawn`-th was drawn.
function after(moves_per_s, seconds, drawn, pace = new Pace()) {
  for (let i = 0; i < moves_per_s * seconds; ++i) {
    pace.moved(100 + i / moves_per_s);
    if (i % drawn === 0) pace.drew();
  }
  return pace;
}

test('it is too slow where few pictures are drawn of much movement', () => {
  for (const [moves_per_s, seconds, drawn, few, why] of [
    [60, 7, 24, true, '2.5 a second'],
    [60, 60, 12, false, '5 a second'],
    [60, 5, 24, false, 'not yet'],
    [2, 600, 1, false, 'there is little to draw'],
    [5, 60, 2, true, '2.5 of 5 a second'],
    [60, 7, 17, false, '3.53 a second'],
    [60, 7, 20, true, '3 a second'],
  ])
    assert.equal(after(moves_per_s, seconds, drawn).few, few, why);
  assert.ok(Math.abs(after(60, 7, 24).per_s - 2.5) < 0.2);
});

test('a window that draws nothing is covered, not slow', () => {
  const pace = new Pace();
  for (let i = 0; i < 3600; ++i) pace.moved(i / 60);
  assert.equal(pace.few, false);
  after(60, 7, 6, pace);
  assert.equal(pace.fewLooks, 0, 'nor once it is seen again');
  assert.ok(pace.looks >= 3);
});

test('seconds for each picture are slow, though some looks would see none', () => {
  const pace = after(60, 20.1, 300);
  assert.equal(pace.few, true);
  assert.ok(Math.abs(pace.per_s - 0.2) < 0.05);
});

test('one look that is not slow ends the row, and begin forgets it', () => {
  const pace = after(60, 4.1, 24);
  assert.equal(pace.fewLooks, 2);
  after(60, 2.1, 6, pace);
  assert.equal(pace.fewLooks, 0);
  assert.equal(after(60, 7, 24, pace).few, true);
  pace.begin();
  assert.equal(pace.few, false);
});

test('a time that jumps, or goes back, is no movement', () => {
  const pace = new Pace();
  for (const time_s of [1, 100, 50, 51, 10, 2000]) pace.moved(time_s);
  assert.equal(pace.moving_s, 0);
});
