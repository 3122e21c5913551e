// The alarms: one for each object that is threatened, which grows, sinks and ends; a flood is summed up; what is
// acknowledged.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import test from 'node:test';
import {aState, kPageScripts, Page} from './browser.mjs';

const named = name => ({key: 'object.named', values: {name}});
const hit = (number, object_id, change = {}) => ({
  number,
  alert: 100 + number,
  t: number,
  rule: 'far_nearing',
  link: 'gripper',
  object: `object${object_id}`,
  object_words: named(`object${object_id}`),
  object_id,
  contact_s: 0.8,
  at_m: [0.5, 0.25, 0.4],
  towards: [0.01, 0, 0],
  speed_m_s: 0.2,
  cleared_after_s: null,
  ...change,
});
const threat = (object_id, contact_s, change = {}) => ({
  link: 'gripper',
  object_words: named(`object${object_id}`),
  object_id,
  rule: 'far_nearing',
  contact_s,
  error_s: 0.05,
  gap_m: 0.04,
  ...change,
});

const alive = () => {
  const data = new DataView(new ArrayBuffer(16));
  data.setUint8(0, 3);
  return data.buffer;
};

async function open() {
  const page = new Page(kPageScripts, {answers: {session: () => [200, {secrets: false, role: null}]}});
  await page.clock.advance(5);
  const [socket] = page.window.sockets;
  socket.open();
  page.socket = socket;
  page.hear = message => socket.hear({type: 'state', ...message});
  // These alerts and threats are there now.
  page.now = (hits, threats = []) =>
    page.hear({
      hits: Object.fromEntries(hits.map(one => [one.number, one])),
      total_hits: hits.length,
      percept: {threats, threat_count: threats.length},
    });
  page.hear(aState());
  page.items = () =>
    page.document
      .querySelectorAll('#alarms li')
      .map(item => [item.className, item.querySelector('.what').textContent, item.querySelector('.why').textContent]);
  // So much time passes, in which states come as they do.
  page.pass = async (ms, hits, threats = []) => {
    for (let past = 0; past < ms; past += 100) {
      page.now(hits, threats);
      socket.hear(alive());
      await page.clock.advance(100);
    }
    page.now(hits, threats);
  };
  return page;
}

const {cases} = JSON.parse(readFileSync(new URL('alarm_cases.json', import.meta.url), 'utf8'));
for (const {name, steps} of cases) {
  test(`as the report counts them: ${name}`, () => {
    const list = new Page(kPageScripts).run('new AlarmList()'),
      hits = [];
    list.take([], [], 0);
    let begun = 0;
    for (const {t_s, raised = [], cleared = [], threats = [], entries} of steps) {
      for (const [number, object_id, rule, contact_s] of raised)
        hits.unshift(hit(number, object_id, {rule, contact_s}));
      for (const number of cleared) hits.find(one => one.number === number).cleared_after_s = 1;
      begun += list
        .take(
          hits,
          threats.map(([object_id, rule, contact_s]) => threat(object_id, contact_s, {rule})),
          1000 * t_s,
        )
        .filter(one => one.opens).length;
      assert.equal(begun, entries, `at ${t_s} s`);
    }
  });
}

test('a threat is one alarm, however many alerts and links it has, with the most urgent link', async () => {
  const page = await open();
  page.now([hit(1, 3, {cleared_after_s: 0.1})]);
  assert.deepEqual(page.items(), [['over', 'gripper → object3', 'over']], 'also one that was over before it was told');
  page.now([hit(1, 3)], [threat(3, 2.4)]);
  assert.deepEqual(page.items(), [['medium', 'gripper → object3', 'soon · nearing']]);
  page.now(
    [hit(1, 3), hit(2, 3, {link: 'wrist'}), hit(3, 3, {rule: 'very_close'})],
    [threat(3, 0.4), threat(3, 1.3, {link: 'wrist'})],
  );
  assert.deepEqual(page.items(), [['high', 'gripper and 1 more → object3', 'urgent · nearing · 3 times']]);
  assert.equal(page.text('alarm-count'), '1');
  assert.match(page.document.querySelector('#alarms a').href, /hits\/103\.jpg$/, 'the picture of its newest alert');
});

// So many objects threaten, each by a motion of its own: alerts that follow each other after more than two seconds.
async function apart(page, ids, change = {}) {
  const hits = [];
  for (const id of ids) {
    hits.unshift(hit(id, id, change));
    page.now(hits.map((one, i) => (i === 0 ? one : {...one, cleared_after_s: 0.5})));
    page.now(hits.map(one => ({...one, cleared_after_s: 0.5})));
    await page.pass(
      2100,
      hits.map(one => ({...one, cleared_after_s: 0.5})),
    );
  }
  return hits;
}

test('what threatens in one motion is one entry, which leads with the most urgent object and names the others', async () => {
  const page = await open();
  page.now(
    [1, 2].map(id => hit(id, id)),
    [threat(2, 0.6), threat(1, 1.5)],
  );
  assert.deepEqual(page.items(), [['high', 'gripper → object2', 'urgent · nearing · 2 times · also object1']]);
  page.now([hit(1, 1), hit(2, 2, {cleared_after_s: 1})], [threat(1, 0.5, {link: 'wrist'})]);
  assert.deepEqual(
    page.items(),
    [['high', 'wrist → object1', 'urgent · nearing · 2 times']],
    'it leads with what threatens now',
  );
  page.now([hit(1, 1, {cleared_after_s: 1}), hit(2, 2, {cleared_after_s: 1})]);
  assert.match(page.items()[0][2], /^over · 2 times · also object2$/);
});

test('all entries beyond three are summed up, and those that are over come last', async () => {
  const page = await open(),
    hits = await apart(page, [1, 2, 3, 4]);
  assert.equal(page.items().length, 3);
  assert.match(page.text('alarm-summary'), /^1 more: object\d\.$/);
  const over = hits.map(one => ({...one, cleared_after_s: 0.5}));
  page.now([hit(5, 5), ...over], [threat(5, 0.2)]);
  assert.deepEqual(page.items()[0].slice(0, 2), ['high', 'gripper → object5']);
  assert.equal(page.text('alarm-count'), '1', 'of those that threaten');
});

test('an alarm rises at once, sinks only after a second, and stays for a while when it is over', async () => {
  const page = await open(),
    kind = () => page.items()[0]?.[0];
  page.now([hit(1, 3)], [threat(3, 0.5)]);
  assert.equal(kind(), 'high');
  await page.pass(800, [hit(1, 3)], [threat(3, 5)]);
  assert.equal(kind(), 'high', 'no flicker');
  await page.pass(400, [hit(1, 3)], [threat(3, 5)]);
  assert.equal(kind(), 'low');
  page.now([hit(1, 3)], [threat(3, 0.9)]);
  assert.equal(kind(), 'high');
  const over = hit(1, 3, {cleared_after_s: 1.2});
  page.now([over]);
  assert.deepEqual(page.items(), [['over', 'gripper → object3', 'over']]);
  assert.equal(page.text('alarm-count'), '0');
  await page.pass(9000, [over]);
  page.now([over, hit(2, 3)], [threat(3, 2)]);
  assert.equal(page.items()[0][2], 'soon · nearing · 2 times', 'a threat that returns soon continues its alarm');
  page.now([over, hit(2, 3, {cleared_after_s: 0.5})]);
  await page.pass(10100, [over, hit(2, 3, {cleared_after_s: 0.5})]);
  assert.deepEqual(page.items(), []);
  assert.equal(page.text('alarm-summary'), 'Nothing threatens.');
});

test('Q acknowledges; what becomes worse, or another object, asks again; what is acknowledged and over goes', async () => {
  const page = await open(),
    kinds = () => page.items().map(([kind]) => kind);
  page.now([hit(1, 3)], [threat(3, 2)]);
  page.press('q');
  assert.deepEqual(kinds(), ['medium acknowledged']);
  assert.equal(page.byId('alarm-panel').classList.contains('waits'), false);
  page.now([hit(1, 3)], [threat(3, 0.7)]);
  assert.deepEqual(kinds(), ['high'], 'it is worse than what was acknowledged');
  assert.ok(page.byId('alarm-panel').classList.contains('waits'));
  page.document.querySelector('#alarms .acknowledge').click();
  assert.deepEqual(kinds(), ['high acknowledged']);
  page.now([hit(1, 3), hit(2, 4)], [threat(3, 0.7), threat(4, 0.8)]);
  assert.deepEqual(kinds(), ['high'], 'another object was not acknowledged');
  page.press('q');
  page.now([hit(1, 3, {cleared_after_s: 1}), hit(2, 4)], [threat(4, 0.7)]);
  assert.deepEqual(kinds(), ['high acknowledged']);
  page.now([hit(1, 3, {cleared_after_s: 1}), hit(2, 4, {cleared_after_s: 1})]);
  assert.deepEqual(kinds(), []);
});

test('what was over before the page was opened is history, and what threatens then is an alarm', async () => {
  const page = await open();
  page.now([]); // aState had none
  const late = await open();
  late.run('alarmList.started = false');
  late.now([hit(1, 3, {cleared_after_s: 1}), hit(2, 4)], [threat(4, 2)]);
  assert.deepEqual(
    late.items().map(([, what]) => what),
    ['gripper → object4'],
  );
  assert.deepEqual(page.items(), []);
});

test('more than ten new alarms in ten minutes are said to be a flood, until they are past', async () => {
  const page = await open(),
    nine = [1, 2, 3, 4, 5, 6, 7, 8, 9],
    hits = await apart(page, nine);
  assert.doesNotMatch(page.text('alarm-summary'), /Flood/);
  const over = hits.map(one => ({...one, cleared_after_s: 0.5}));
  page.now([hit(10, 10), ...over]);
  assert.match(page.text('alarm-summary'), /Flood: 10 new alarms in ten minutes\.$/);
  page.clock.stall(600_001);
  page.now([hit(10, 10, {cleared_after_s: 0.5}), ...over]);
  page.clock.stall(11_000);
  page.now(over);
  assert.equal(page.text('alarm-summary'), 'Nothing threatens.');
});

test('a new alarm is said once to screen readers', async () => {
  const page = await open();
  page.now([hit(1, 3)], [threat(3, 2)]);
  assert.equal(page.text('alarm-news'), 'gripper may hit object3.');
  page.run("put('alarm-news', '')");
  page.now([hit(1, 3), hit(2, 3)], [threat(3, 0.3)]);
  assert.equal(page.text('alarm-news'), '');
});

test('the place stands there until the picture comes, which is asked for again while it is not made', async () => {
  const page = await open();
  page.now([hit(1, 3)], [threat(3, 2)]);
  const image = page.document.querySelector('#alarms img'),
    asked = () => image.src;
  assert.ok(image.hidden);
  const place = page.document.querySelector('#alarms circle');
  // The cell is 2 m × 1 m; the operator looks along −x: y grows to the right, and x towards him.
  assert.deepEqual([+place.getAttribute('cx'), +place.getAttribute('cy')].map(Math.round), [71, 27]);
  const way = page.document.querySelector('#alarms line');
  assert.ok(
    +way.getAttribute('y2') > +way.getAttribute('y1') && +way.getAttribute('x2') === +way.getAttribute('x1'),
    'towards the object',
  );
  image.src = 'elsewhere';
  page.point('error', image);
  await page.clock.advance(600);
  assert.match(asked(), /hits\/101\.jpg$/);
  page.point('load', image);
  assert.equal(image.hidden, false);
  for (let tries = 0; tries < 30; ++tries) page.point('error', image);
  await page.clock.advance(600);
  image.src = 'elsewhere';
  page.point('error', image);
  await page.clock.advance(600);
  assert.equal(asked(), 'elsewhere', 'not for ever');
});

test('the three most urgent threats stand with seconds, link and object, and how many more there are', async () => {
  const page = await open(),
    rows = () =>
      page.document
        .querySelectorAll('#threats li')
        .map(row => [row.className, row.firstChild.textContent, row.lastChild.textContent]);
  assert.equal(page.text('threats-none'), 'Nothing ahead.');
  page.hear({
    percept: {
      threats: [threat(3, 0.42), threat(4, 1.96, {link: 'wrist'}), threat(5, null, {error_s: null, gap_m: null})],
      threat_count: 5,
    },
  });
  assert.deepEqual(rows(), [
    ['high', '0.4 s', 'gripper → object3'],
    ['medium', '2.0 s', 'wrist → object4'],
    ['low', '–', 'gripper → object5'],
  ]);
  assert.equal(page.text('threats-none'), 'and 2 more');
  assert.equal(
    page.document.querySelector('#threats li').title,
    'gripper → object3\nnearing\ngap 40 mm\nknown to ±0.05 s',
  );
  page.hear({percept: {known: false, threats: [], threat_count: 0}});
  assert.deepEqual(rows(), []);
  assert.equal(page.text('threats-none'), 'unknown');
});
