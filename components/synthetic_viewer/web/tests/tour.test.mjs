// The tour of the page, and the tips of what is not said in plain words.
import assert from 'node:assert/strict';
import test from 'node:test';
import {aState, kPageScripts, Page} from './browser.mjs';

const kSeen = {'phantom.tour': 'seen'};
async function open({change = {}, ...options} = {}) {
  const answers = {
    session: () => [200, {secrets: false, role: null}],
    command: () => [200, {ok: true, message: 'done'}],
  };
  const page = new Page(kPageScripts, {answers, ...options});
  await page.clock.advance(5);
  const [socket] = page.window.sockets;
  socket.open();
  page.hear = message => socket.hear({type: 'state', ...message});
  page.hear({...aState(), ...change});
  page.toured = () => page.document.querySelectorAll('.toured').map(e => e.id);
  return page;
}

test('the first visit offers a tour, a later one does not, nor one that was told: not now', async () => {
  const page = await open();
  assert.equal(page.byId('tour').hidden, false);
  assert.match(page.text('tour-words'), /^New here\?/);
  assert.deepEqual(page.toured(), []);
  page.byId('tour-end').click();
  assert.ok(page.byId('tour').hidden);
  assert.ok((await open({kept: page.window.localStorage.kept})).byId('tour').hidden);
  assert.ok(
    (await open({change: {review: {t: 0, utc_ms: 0, playing: false, rate: 1}}})).byId('tour').hidden,
    'a recording has nothing to command',
  );
  assert.ok((await open({search: '?view=hit'})).byId('tour').hidden, 'nor has a window with one view');
});

test('it has five steps, each frames what it is about; back, next, done', async () => {
  const page = await open(),
    next = () => page.byId('tour-next').click(),
    steps = [];
  next();
  assert.equal(page.document.activeElement.id, 'tour-next', 'the next step is one press away');
  assert.ok(page.byId('tour-back').hidden);
  for (let i = 0; i < 5; ++i) {
    assert.equal(page.text('tour-count'), `${i + 1} of 5`);
    steps.push(...page.toured());
    if (i === 2) {
      page.byId('tour-back').click();
      assert.equal(page.text('tour-count'), '2 of 5');
      next();
    }
    if (i < 4) next();
  }
  assert.deepEqual(steps, ['main-figure', 'felt', 'alarm-panel', 'why-line', 'stop']);
  assert.equal(page.text('tour-next'), 'Done');
  page.run("speak('de')");
  assert.match(page.text('tour-words'), /^Esc hält den Arm von überall an/);
  next();
  assert.ok(page.byId('tour').hidden);
  assert.deepEqual(page.toured(), []);
});

test('it begins again from the drawer with the keys, and shows what a large view hides', async () => {
  const page = await open({kept: {...kSeen, 'phantom.layout': '{"large":"main","enlarged":true}'}});
  page.press('?');
  page.byId('tour-begin').click();
  assert.equal(page.text('tour-count'), '1 of 5');
  assert.ok(page.byId('keys').hidden);
  assert.equal(page.byId('desk').classList.contains('enlarged'), false);
});

test('Esc stops the arm during the tour, and the tour goes on', async () => {
  const page = await open();
  page.byId('tour-next').click();
  page.press('Escape');
  await page.clock.advance(5);
  assert.deepEqual(
    page.posted('command').map(({kind}) => kind),
    ['emergency_stop'],
  );
  assert.equal(page.text('tour-count'), '1 of 5');
});

// What only its author understands without a tip: symbols, units beyond those of everyday, letters of tables, names of
// processes, states.
const kNeedTip = [
  /(^|\s)G(\s|$)/,
  /1\/A/,
  /N·m/,
  /99\s?%/,
  /\(([a-e]|[bd][12])\)/,
  /^[A-Z]{4,}$/,
  /[a-z]+_[a-z]+/,
  /^(Round trip|Link|Pose age|Voxel error|Umlaufzeit)$/,
];
const kWithoutText = new Set(['SCRIPT', 'STYLE', 'KBD']); // of keys: their lines say what they do
function withoutTip(page) {
  const found = [],
    all = [];
  page.document.documentElement.walk(element => {
    all.push(element);
    return false;
  });
  for (const element of all) {
    if (
      element.children.length ||
      kWithoutText.has(element.tagName) ||
      ['#texts', '#calibration', '.choice-list'].some(one => element.closest(one))
    )
      continue;
    const words = element.textContent.trim();
    if (!kNeedTip.some(pattern => pattern.test(words))) continue;
    const row = element.parentElement,
      tip = [element, row, row.parentElement, ...row.children].some(one => one?.title);
    if (!tip) found.push(`${element.id || element.tagName}: ${words}`);
  }
  return found;
}

test('every abbreviation, symbol, state and name of a process has a tip, in both languages', async () => {
  const loop = {name: 'servo', rate_hz: 1000, p99_us: 90, slips: 2, silent_s: null};
  const component = name => ({
    name,
    state: 'RUNNING',
    host: 'desk',
    loops: [loop],
    refused: 0,
    deadline_missed: 0,
    message: '',
    simulated: true,
  });
  const page = await open({
    change: {
      components: {a: component('slave_io'), b: component('phantom_sensing_2')},
      link: {
        ...aState().link,
        percepts_words: {
          key: 'percept.in_force',
          values: {
            row: {key: 'percept_row.torque_balanced', values: {}},
            chosen: {key: 'percept_chosen.1', values: {}},
          },
        },
      },
    },
  });
  for (const language of ['en', 'de']) {
    page.run(`speak('${language}')`);
    assert.deepEqual(withoutTip(page), [], language);
  }
  const [row] = page.document.querySelectorAll('#components tr');
  assert.match(row.title, /^Treibt den Arm/);
  page.byId('quality').title = '';
  page.document.querySelector('[data-text="fact.link"]').title = '';
  page.byId('gain-now').title = page.document.querySelector('[for=gain]').title = '';
  assert.ok(withoutTip(page).length > 0, 'one without a tip is found');
});
