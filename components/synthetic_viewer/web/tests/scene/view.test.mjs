// One view that the browser draws: when there is anything to draw into.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Window} from '../browser.mjs';
import {module} from './modules.mjs';

test('of several changes of what is seen that come at once the last one holds', async () => {
  const page = new Window();
  for (const name of ['document', 'ResizeObserver', 'IntersectionObserver', 'devicePixelRatio', 'sessionStorage'])
    Object.defineProperty(globalThis, name, {value: page[name], configurable: true, writable: true});
  const {DrawnView} = await module('view.js');
  let changes = 0;
  const view = new DrawnView(
    'main',
    true,
    () => ++changes,
    () => undefined,
  );
  page.sights.at(-1)([{isIntersecting: false}, {isIntersecting: true}]);
  assert.ok(view.visible);
  page.sights.at(-1)([{isIntersecting: false}]);
  assert.ok(!view.visible);
  assert.equal(changes, 2);
});
