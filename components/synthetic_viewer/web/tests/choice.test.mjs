// A choice of one of several: by pointer and by keys, and which changes it reports.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Page} from './browser.mjs';

function open() {
  const page = new Page(['language.js', 'stop.js', 'choice.js']),
    button = page.byId('law');
  const list = page.byId('law-list'),
    options = () => list.children,
    marked = () => options().findIndex(option => option.classList.contains('marked'));
  const changes = [];
  button.addEventListener('change', () => changes.push(button.value));
  button.focus();
  return {page, button, list, options, marked, changes};
}

test('a named choice offers the texts of its name, in the language of the page', () => {
  const {page, button, options} = open();
  assert.equal(options().length, 5);
  assert.equal(button.value, '0');
  assert.equal(button.textContent, page.run("text('law.0')"));
  page.run("speak('de')");
  for (const option of options())
    assert.equal(option.textContent, page.run(`kTexts.de['law.${option.dataset.value}']`));
  assert.equal(button.textContent, page.run("kTexts.de['law.0']"));
});

test('arrow keys open it and move, Enter takes, and what moves the choice moves nothing else', () => {
  const {page, button, list, options, marked, changes} = open();
  let heard = 0;
  page.window.addEventListener('keydown', () => ++heard);
  assert.ok(list.hidden);
  for (const [key, expected] of [
    ['ArrowDown', 0],
    ['ArrowDown', 1],
    ['PageDown', 4],
    ['Home', 0],
    ['End', 4],
    ['ArrowDown', 4],
    ['PageUp', 0],
    ['ArrowUp', 0],
    ['ArrowDown', 1],
  ]) {
    assert.ok(page.press(key).defaultPrevented);
    assert.equal(marked(), expected, key);
    assert.equal(button.getAttribute('aria-activedescendant'), `law-${expected}`);
  }
  assert.equal(button.getAttribute('aria-expanded'), 'true');
  page.press('Enter');
  assert.deepEqual(changes, [options()[1].dataset.value]);
  assert.ok(list.hidden && button.getAttribute('aria-expanded') === 'false');
  assert.equal(heard, 0);
  page.press(' ');
  page.press('x');
  assert.equal(heard, 2, 'closed, it leaves other keys alone');
});

test('Esc closes it and goes on to the stop', async () => {
  const {page, list, changes} = open();
  page.answer('command', () => [200, {ok: true, message: ''}]);
  page.run('globalThis.say = () => undefined');
  page.press('ArrowDown');
  page.press('ArrowDown');
  page.press('Escape');
  await page.clock.advance(1);
  assert.ok(list.hidden);
  assert.deepEqual(changes, []);
  assert.deepEqual(page.posted('command'), [{kind: 'emergency_stop'}]);
});

test('a click opens, takes and closes; the same again is no change', () => {
  const {page, button, list, options, changes} = open();
  button.click();
  assert.ok(!list.hidden);
  const {value} = options()[3].dataset;
  options()[3].click();
  assert.deepEqual([changes, list.hidden, button.value], [[value], true, value]);
  assert.equal(
    options().findIndex(option => option.getAttribute('aria-selected') === 'true'),
    3,
  );
  button.click();
  options()[3].click();
  assert.deepEqual(changes, [value]);
  assert.ok(page.point('pointerdown', list).defaultPrevented, 'the focus stays with the button');
  button.click();
  button.blur();
  assert.ok(list.hidden, 'it closes when the focus goes');
});

test('what the viewer reports is shown, unless the operator is about to choose', () => {
  const {page, button, changes} = open();
  page.run("setChoice(byId('law'), '3')");
  assert.equal(button.value, '3');
  page.press('ArrowDown');
  page.run("setChoice(byId('law'), '1')");
  assert.equal(button.value, '3');
  page.press('Escape');
  page.run("setChoice(byId('law'), '99')");
  assert.equal(button.textContent, '–');
  assert.deepEqual(changes, [], 'only an operator changes it');
});

test('a choice that goes on to be offered stays; otherwise the first is chosen', () => {
  const {page} = open(),
    button = page.byId('carry-object'),
    offer = options => page.run(`offerChoice(byId('carry-object'), ${JSON.stringify(options)})`);
  offer([
    ['a', 'A'],
    ['b', 'B'],
  ]);
  assert.deepEqual([button.value, button.textContent], ['a', 'A']);
  page.run("takeChoice(byId('carry-object'), 'b')");
  offer([
    ['x', 'X'],
    ['b', 'B (carried)'],
  ]);
  assert.deepEqual([button.value, button.textContent], ['b', 'B (carried)']);
  offer([['x', 'X']]);
  assert.equal(button.value, 'x');
  offer([]);
  assert.deepEqual([button.value, button.textContent], ['', '–']);
  button.click();
  assert.ok(page.byId('carry-object-list').hidden, 'of nothing nothing opens');
});
