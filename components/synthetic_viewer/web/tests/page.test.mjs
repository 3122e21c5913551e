// The operator's page: what it shows of the state, what its buttons and keys ask for, and what it says when nothing comes.
import assert from 'node:assert/strict';
import test from 'node:test';
import {aState, kPageScripts, Page} from './browser.mjs';

const kOpenSession = {secrets: false, role: null};
// A page that follows its stream. `change` changes the state that comes first; `session`: the answer of GET /session.
async function open({change = {}, session = kOpenSession, ...options} = {}) {
  const page = new Page(kPageScripts, {
    answers: {
      session: () => [200, session],
      stop: () => [200, {in_force: false, alarm: false, notices: []}],
      command: () => [200, {ok: true, message: 'done'}],
      view: () => [200, {ok: true, message: 'done'}],
      ...options.answers,
    },
    ...options,
  });
  await page.clock.advance(5);
  const [socket] = page.window.sockets;
  socket.open();
  page.socket = socket;
  page.hear = message => socket.hear({type: 'state', ...message});
  page.hear({...aState(), ...change});
  return page;
}
const alive = () => {
  const data = new DataView(new ArrayBuffer(16));
  data.setUint8(0, 3);
  return data.buffer;
};
async function goesOn(page, ms) {
  for (const until_ms = page.clock.now_ms + ms; page.clock.now_ms < until_ms; await page.clock.advance(200))
    page.socket.hear(alive());
}
const linkOf = change => ({link: {...aState().link, ...change}});
const viewerOf = change => ({viewer: {...aState().viewer, ...change}});
const commands = page => page.posted('command').splice(0);

test('times and numbers have units that fit, and nothing known is a dash', () => {
  const page = new Page(kPageScripts),
    said = expression => page.run(expression);
  for (const [s, expected] of [
    [0.0000123, '12 µs'],
    [0.0021, '2.10 ms'],
    [0.0123, '12 ms'],
    [0.99, '990 ms'],
    [1, '1.0 s'],
    [61.25, '61.3 s'],
    [null, '–'],
  ])
    assert.equal(said(`duration(${s})`), expected);
  assert.equal(said('fixed(0.1234, 2, " m")'), '0.12 m');
  assert.equal(said('fixed(0, 1)'), '0.0');
  for (const none of ['null', 'undefined']) assert.equal(said(`fixed(${none}, 2, " m")`), '–');
});

test('the figures of the state stand on the page', async () => {
  const page = await open();
  const shown = {
    'slave-state': 'COUPLED',
    'master-state': 'READY',
    'voxel-error': '4.3 mm',
    'round-trip': '2.10 ms',
    'pose-age': '4.00 ms',
    quality: '99.9 %',
    reach: '3',
    closeness: '0.47',
    speed: '0.031 m/s',
    motion: 'dangerous',
    'nearest-link': 'hand',
    'gain-now': '12.00',
    'feedback-now': '0.050',
    cell: 'desk',
  };
  for (const [id, expected] of Object.entries(shown)) assert.equal(page.text(id), expected, id);
  page.hear({
    link: {quality: null, round_trip_s: null, reach: -1, slave: 'NONE'},
    percept: {known: false, closeness: null, speed_m_s: null, motion: 'none'},
    model: {voxel_error_m: null},
  });
  const unknown = {
    'slave-state': 'NONE',
    quality: '–',
    'round-trip': '–',
    reach: '–',
    closeness: '–',
    speed: '–',
    motion: 'no percept',
    'nearest-link': 'unknown',
    'voxel-error': '–',
  };
  for (const [id, expected] of Object.entries(unknown)) assert.equal(page.text(id), expected, id);
});

test('a place that no depth camera sees is said to be one', async () => {
  const page = await open();
  assert.equal(page.byId('unseen').hidden, true);
  page.hear({percept: {unseen: true}});
  assert.equal(page.byId('unseen').hidden, false);
  assert.equal(page.text('unseen'), 'No camera sees this space');
  page.hear({percept: {unseen: false}});
  assert.equal(page.byId('unseen').hidden, true);
});

test('a quality that is not 100 % is never shown as 100 %', async () => {
  const page = await open({change: linkOf({quality: 0.99999})});
  assert.equal(page.text('quality'), '99.9 %');
  page.hear({link: {quality: 1}});
  assert.equal(page.text('quality'), '100.0 %');
});

test('the bars grow with their values, warn, and stay within their frames', async () => {
  const page = await open(),
    bar = id => [page.byId(id + '-bar').style.width, page.byId(id + '-bar').className];
  for (const [closeness, expected] of [
    [0.3, ['30%', '']],
    [0.5, ['50%', 'warm']],
    [0.8, ['80%', 'hot']],
    [1.5, ['100%', 'hot']],
  ]) {
    page.hear({percept: {closeness}});
    assert.deepEqual(bar('closeness'), expected);
  }
  page.hear({percept: {speed_m_s: 0.25}});
  assert.deepEqual(bar('speed'), ['50%', '']);
});

test('the scale of the torques grows by 1, 2, 5 and never shrinks', async () => {
  const page = await open(),
    scale = () => page.run('torqueScale');
  for (const [torque, expected] of [
    [0.5, 1],
    [1.5, 2],
    [4.9, 5],
    [7, 10],
    [19, 20],
    [45, 50],
    [0.1, 50],
  ]) {
    page.hear({joints: {percept_torque: [-torque, 0], feedback_torque: [0, 0]}});
    assert.equal(scale(), expected, `${torque} N·m`);
  }
  const [first, second] = page.byId('joints').children;
  assert.equal(first.querySelector('.value').textContent, '-0.10');
  assert.equal(first.querySelector('.percept').style.transform, 'scaleX(-0.002)');
  assert.equal(first.title, 'j1, in N·m');
  assert.equal(second.title, 'j2, in N');
});

test('alerts are listed newest first, each once, with what is not listed', async () => {
  const hit = number => ({
    number,
    alert: number,
    t: number,
    rule: 'very_close',
    link: 'hand',
    object: 'pump',
    object_words: null,
    speed_m_s: 0.1,
    cleared_after_s: number === 3 ? null : 0.5,
  });
  const page = await open({change: {hits: {1: hit(1), 2: hit(2), 3: hit(3)}, total_hits: 13}});
  assert.equal(page.document.querySelectorAll('#hits li').length, 0, 'no picture is asked for while nobody looks');
  page.byId('alarm-history').click();
  const items = () => page.document.querySelectorAll('#hits li'),
    listed = () => items().map(item => item.querySelector('img')?.src ?? item.textContent);
  assert.deepEqual(listed(), ['hits/3.jpg', 'hits/2.jpg', 'hits/1.jpg', '10 earlier alerts are not listed.']);
  assert.equal(page.text('hit-count'), '13');
  assert.equal(items()[0].className, 'threatening');
  assert.match(items()[0].querySelector('.why').textContent, /^#3 at 3\.0 s, very close, 0\.10 m\/s, threatens$/);
  assert.match(items()[1].querySelector('.why').textContent, /lasted 500 ms$/);
  page.hear({hits: {1: hit(41), 3: {...hit(3), cleared_after_s: 1.5}}, total_hits: 41}); // a newer one takes the oldest one's place
  assert.deepEqual(listed(), ['hits/41.jpg', 'hits/3.jpg', 'hits/2.jpg', '38 earlier alerts are not listed.']);
  assert.equal(items()[1].className, '');
  page.run('speak("de")');
  assert.equal(listed().at(-1), '38 frühere Alarme stehen nicht in der Liste.');
  page.hear({hits: {}, total_hits: 0});
  page.run('speak("en")');
  assert.deepEqual(listed(), ['None so far.']);
});

test('components are listed by name; of a loop that hangs the time since its last tick is shown', async () => {
  const component = (name, change = {}) => ({
    name,
    host: 'pc',
    state: 'RUNNING',
    message: '',
    simulated: false,
    refused: 2,
    deadline_missed: 1,
    loops: [{name: 'servo', rate_hz: 999.6, p99_us: 12, silent_s: null, slips: 0}],
    ...change,
  });
  const page = await open({
    change: {
      components: {
        b: component('slave_io', {simulated: true}),
        a: component('master_io', {
          message: 'is degraded',
          loops: [{name: 'servo', rate_hz: 1000, p99_us: 12, silent_s: 7.2, slips: 3}],
        }),
        gone: null,
      },
    },
  });
  const rows = page.document.querySelectorAll('#components tr').map(row => row.children.map(cell => cell.textContent));
  assert.deepEqual(rows, [
    ['master_io', 'RUNNING', 'no tick for 7 s', '12 µs', '2 / 1'],
    ['is degraded'],
    ['slave_io (simulated)', 'RUNNING', '1000 Hz', '12 µs', '2 / 1'],
  ]);
});

test('the banner says what the viewer says; that nothing comes; and that nobody is logged in', async () => {
  const page = await open(),
    banner = () => (page.byId('banner').hidden ? '' : page.text('banner'));
  assert.equal(banner(), '');
  page.hear({banner: 'in English', banner_words: null});
  assert.equal(banner(), 'in English');
  page.hear({banner: ''});
  await goesOn(page, 2000);
  assert.equal(banner(), '');
  await page.clock.advance(480);
  assert.equal(banner(), 'NOTHING COMES FROM THE VIEWER: the numbers stand still');
  await page.clock.advance(2200);
  assert.equal(banner(), 'NO CONNECTION TO THE VIEWER: what you see is out of date');
  page.socket.hear(alive());
  assert.equal(banner(), '');
  page.run('session = { secrets: true, role: null }');
  await page.clock.advance(3000);
  assert.equal(banner(), 'NOT LOGGED IN: only the emergency stop works');
});

test('while nothing comes by the stream the state is asked for, and not otherwise', async () => {
  const page = await open(),
    asked = () => page.window.requests.filter(one => one.path === 'state').length;
  await goesOn(page, 5000);
  assert.equal(asked(), 0);
  page.answer('state', () => [200, {...aState(), cell: 'polled'}]);
  page.answer('.', () => [200, '<meta name="stream-port" content="8081">']);
  await page.clock.advance(3000);
  assert.ok(asked() >= 8, `${asked()} times in 3 s`);
  assert.equal(page.text('cell'), 'polled');
  assert.ok(page.byId('banner').hidden, "the numbers come by the page's port meanwhile");
  assert.equal(page.window.location.reloads, 0, 'the streams are where they were');
  page.document.hidden = true;
  const before = asked();
  await page.clock.advance(2000);
  assert.equal(asked(), before);
});

test('a viewer that was started again with its streams on another port is found by loading the page again', async () => {
  const page = await open();
  page.answer('state', () => [200, aState()]);
  page.answer('.', () => [200, '<meta name="stream-port" content="9999">']);
  await page.clock.advance(3500); // it is looked for every three seconds
  assert.ok(page.window.location.reloads > 0);
});

test('a session that has ended is asked for again', async () => {
  for (const end of [page => page.socket.end(4001), page => page.answer('state', () => [401, {}])]) {
    const page = await open(),
      asked = () => page.window.requests.filter(one => one.path === 'session').length,
      before = asked();
    end(page);
    await page.clock.advance(1500);
    assert.ok(asked() > before);
  }
  const page = await open(),
    before = page.window.requests.filter(one => one.path === 'session').length;
  page.socket.end(1006);
  await page.clock.advance(1500);
  assert.equal(
    page.window.requests.filter(one => one.path === 'session').length,
    before,
    'a connection that breaks ends none',
  );
});

test('each percept is switched by its button and by its key, the others stay; L leaves them to the law', async () => {
  const page = await open();
  const expected = {drag: 6, tone: 5, views: 3, 'by-law': 8};
  for (const id of Object.keys(expected)) page.byId(id).click();
  for (const key of ['d', 'm', 'v', 'L']) page.press(key);
  assert.deepEqual(
    commands(page),
    [...Object.values(expected), ...Object.values(expected)].map(value => ({kind: 'set_percepts', value})),
  );
  page.press('d', {repeat: true});
  assert.equal(page.posted('command').length, 8, 'a key that is held is pressed once');
  page.hear({link: {drag_chosen: false, tone_enabled: true, views_enabled: false, percept_set_automatic: true}});
  page.byId('drag').click();
  assert.deepEqual(page.posted('command').at(-1), {kind: 'set_percepts', value: 3});
  const pressed = Object.keys(expected).map(id => page.byId(id).getAttribute('aria-pressed'));
  assert.deepEqual(pressed, ['false', 'true', 'false', 'true']);
});

test('what stands beside a gain says why it is not what was asked for', async () => {
  const page = await open({change: linkOf({percept_limited: true, feedback_damped: true})});
  assert.equal(page.text('gain-now'), '12.00 (held: stability)');
  assert.notEqual(page.text('feedback-now'), '0.050');
  page.hear({link: {percept_limited: false, percept_capped: true, feedback_damped: false, feedback_capped: true}});
  assert.equal(page.text('gain-now'), '12.00 (greatest torque reached)');
  assert.equal(page.text('feedback-now'), '0.050 (greatest torque reached)');
  page.hear({link: {feedback_capped: false, force_missing: true}});
  assert.match(page.text('feedback-now'), /^0\.050.*sensor/);
  assert.ok(page.byId('counterbalance').hidden, 'a balanced arm has nothing to switch');
  page.hear({link: {counterbalance: 'automatic'}});
  assert.equal(page.byId('counterbalance').hidden, false);
  page.byId('counterbalance').click();
  assert.deepEqual(page.posted('command').at(-1), {kind: 'counterbalance', value: 0});
});

test('nodes, hold and recording have keys; a letter that is typed is a letter', async () => {
  const page = await open();
  for (const key of ['a', 'n', 's', 'e', 'w', 't', 'b', '3', '8', 'h']) page.press(key);
  const nodes = [0, 9, 10, 11, 12, 13, 14, 3, 8].map(value => ({kind: 'view_node', value}));
  assert.deepEqual(commands(page), [...nodes, {kind: 'view_hold', value: 1}]);
  page.hear({view: {hold: true}});
  page.press('H');
  assert.deepEqual(page.posted('command').at(-1), {kind: 'view_hold', value: 0});
  page.byId('hit-view').focus();
  page.press('r');
  await page.clock.advance(1);
  assert.deepEqual(
    page.posted('view').map(({view, record}) => [view, record]),
    [['hit', true]],
  );
  const count = page.posted('command').length;
  for (const key of ['b', '2', 'd']) page.press(key, {}, page.byId('gain'));
  for (const modifier of ['ctrlKey', 'altKey', 'metaKey']) page.press('d', {[modifier]: true});
  page.press('9');
  assert.equal(page.posted('command').length, count);
});

test('a viewer that only shows has no button, key or pointer that commands, the stop among them', async () => {
  const page = await open({change: viewerOf({allow_commands: false})});
  const controls = page.document.querySelectorAll(
    '#commands button, #commands input, #gripper button, #stop, #stop-reset, #node, #hold, [data-tools] button',
  );
  assert.ok(controls.length > 20);
  for (const control of controls) assert.ok(control.disabled, control.id || control.className);
  assert.match(page.text('answer'), /only shows/);
  page.byId('main-view').focus();
  for (const key of ['ArrowLeft', 'r', 'd']) page.press(key);
  await page.clock.advance(5);
  assert.deepEqual(page.posted('view'), []);
  assert.deepEqual(page.posted('command'), []);
});

test('each role may do what it may: who watches stops, who operates commands, who configures sets laws', async () => {
  const expected = {watch: [false, true, true], operate: [false, false, true], configure: [false, false, false]};
  for (const [role, [stop, reset, law]] of Object.entries(expected)) {
    const page = await open({session: {secrets: true, role}});
    assert.deepEqual(
      [page.byId('stop').disabled, page.byId('reset').disabled, page.byId('law').disabled],
      [stop, reset, law],
      role,
    );
    assert.equal(page.text('role'), `Role: ${role}`);
    assert.ok(page.byId('login').hidden && !page.byId('logout').hidden);
  }
  const page = await open({session: {secrets: true, role: null}});
  assert.ok(
    !page.byId('login').hidden &&
      page.byId('logout').hidden &&
      !page.byId('stop').disabled &&
      page.byId('reset').disabled,
  );
});

test('logging in says why it failed, and lets the stream hurry once it did not', async () => {
  const page = await open({session: {secrets: true, role: null}});
  page.socket.end(4001);
  page.byId('secret').value = ' wrong ';
  page.answer('login', () => [403, {ok: false, message: 'none of the page'}]);
  page.point('submit', page.byId('login'));
  await page.clock.advance(1);
  assert.equal(page.text('login-answer'), 'Not logged in: none of the page');
  assert.deepEqual(page.posted('login'), [{secret: 'wrong'}]);
  page.answer('login', () => {
    throw new Error('refused');
  });
  page.point('submit', page.byId('login'));
  await page.clock.advance(1);
  assert.equal(page.text('login-answer'), 'Not logged in: the viewer does not answer (refused)');
  page.answer('login', () => [200, {ok: true, secrets: true, role: 'operate'}]);
  const sockets = page.window.sockets.length;
  page.point('submit', page.byId('login'));
  await page.clock.advance(1);
  assert.equal(page.text('login-answer'), '');
  assert.equal(page.text('role'), 'Role: operate');
  assert.equal(page.byId('secret').value, '', 'the secret does not stay on the page');
  assert.equal(page.window.sockets.length, sockets + 1);
  page.answer('logout', () => [200, {ok: true}]);
  page.byId('logout').click();
  await page.clock.advance(1);
  assert.equal(page.window.location.reloads, 1);
});

test('how a command ended is said in the words of who answered', async () => {
  const page = await open();
  const ends = async (answer, text, bad) => {
    page.answer('command', typeof answer === 'function' ? answer : () => answer);
    page.byId('feedback').value = '10';
    page.point('submit', page.byId('feedback-form'));
    await page.clock.advance(1);
    assert.equal(page.text('answer'), text);
    assert.equal(page.byId('answer').className, bad ? 'bad' : '');
  };
  await ends([200, {ok: true, message: 'done'}], 'Feedback: done', false);
  await ends(
    [400, {ok: false, message: 'master_io: not now; allowed is later'}],
    'Refused: master_io: not now; allowed is later',
    true,
  );
  await ends(
    [504, {ok: false, message: 'NOT CONFIRMED by master_io'}],
    'Not confirmed: Feedback: NOT CONFIRMED by master_io',
    true,
  );
  await ends(
    () => {
      throw new Error('gone');
    },
    'Not sent: the viewer does not answer (gone)',
    true,
  );
  assert.deepEqual(page.posted('command')[0], {kind: 'set_feedback_gain', value: 10});
});

test('a reset is asked for, and Esc is a no', async () => {
  const page = await open(),
    asked = () => !page.byId('reset-question').hidden;
  page.byId('reset').click();
  assert.ok(asked() && page.document.activeElement.id === 'reset-no', 'what is pressed by mistake is the no');
  page.byId('reset-no').click();
  assert.ok(!asked() && page.document.activeElement.id === 'reset');
  page.byId('reset').click();
  page.press('Escape');
  assert.ok(!asked());
  await page.clock.advance(1);
  assert.deepEqual(commands(page), [{kind: 'emergency_stop'}]);
  page.byId('reset').click();
  page.byId('reset-yes').click();
  assert.deepEqual(page.posted('command').at(-1), {kind: 'reset'});
});

test('what is carried can be put down, and what is not can be taken', async () => {
  const page = await open(),
    choice = page.byId('carry-object');
  page.answer('carry', () => [200, {ok: true, message: 'taken'}]);
  assert.deepEqual([choice.value, page.byId('attach').hidden, page.byId('release').hidden], ['pump', false, true]);
  page.byId('attach').click();
  page.run("takeChoice(byId('carry-object'), 'vice')");
  assert.deepEqual([page.byId('attach').hidden, page.byId('release').hidden], [true, false]);
  page.byId('release').click();
  assert.deepEqual(page.posted('carry'), [
    {object: 'pump', attach: true},
    {object: 'vice', attach: false},
  ]);
  page.hear({objects: [{name: 'pump', carried: false}]});
  assert.equal(choice.value, 'pump', 'what is no longer there is not chosen');
});

test('a gripper has its limits, in the units of the page', async () => {
  const gripper = {
    state_words: {key: 'gripper.title', values: {}},
    fault: false,
    width_m: 0.04,
    requested_force_N: 30,
    widest_m: 0.11,
    least_force_N: 3,
    greatest_force_N: 60,
  };
  const page = await open({change: {gripper}});
  assert.equal(page.byId('gripper').hidden, false);
  assert.equal(page.byId('gripper-width').max, 110);
  assert.deepEqual(
    [page.byId('gripper-force').min, page.byId('gripper-force').max, page.text('gripper-force-now')],
    [3, 60, '30.0 N'],
  );
  page.byId('gripper-width').value = '42';
  page.point('submit', page.byId('gripper-width-form'));
  page.byId('gripper-open').click();
  page.byId('gripper-close').click();
  assert.deepEqual(
    commands(page),
    [0.042, 1, 0].map(value => ({kind: 'gripper_width', value})),
  );
  for (const change of [{fault: true}, {width_m: null}]) {
    page.hear({gripper: {...gripper, ...change}});
    assert.equal(page.byId('gripper-words').className, 'bad');
  }
  page.hear({gripper: null});
  assert.ok(page.byId('gripper').hidden);
});

test('an object that a camera sees elsewhere is listed, and put there by a click', async () => {
  const page = await open(),
    model = {...aState().model, undo: null},
    words = what => ({key: 'finding.elsewhere', values: {object: what, camera: 'above', shift_mm: 100}}),
    finding = {what_words: words('drum'), shift_m: 0.1, turn_rad: 0.1, residual_m: 0.003, unseen: ''},
    items = () => page.byId('doubts').children;
  page.answer('model', () => [200, {ok: true, message: 'moved'}]);
  page.hear({model, findings: {drum: finding}});
  assert.ok(!page.byId('model-doubts').hidden);
  assert.equal(items().length, 1);
  const button = items()[0].children.at(-1);
  assert.match(button.textContent, /drum/);
  assert.match(button.title, /100 mm.*6°.*3 mm.*nothing/);
  button.click();
  assert.deepEqual(page.posted('model'), [{found: 'drum'}]);
  page.hear({findings: {drum: {...finding, shift_m: null, turn_rad: null, residual_m: null}}});
  assert.equal(items()[0].children.length, 1, 'where it is, is not known');
  page.hear({findings: {drum: null}});
  assert.ok(page.byId('model-doubts').hidden);
});

test('what cameras see and the model lacks is listed with what may be decided', async () => {
  const page = await open(),
    thing = (standing, object = 'live object 1') => ({
      standing,
      what_words: {key: `live.${standing}`, values: {object}},
    }),
    items = () => page.byId('things').children,
    buttons = item => item.children.filter(child => child.tagName === 'BUTTON').map(button => button.textContent);
  page.answer('model', () => [200, {ok: true, message: 'done'}]);
  assert.ok(page.byId('live-things').hidden);
  page.hear({live: {'live object 1': thing('tracked'), 'live object 2': thing('frozen')}});
  assert.ok(!page.byId('live-things').hidden);
  assert.deepEqual([...items()].map(buttons), [
    ['Keep', 'Ignore'],
    ['Follow again', 'Ignore'],
  ]);
  items()[0]
    .children.find(child => child.textContent === 'Ignore')
    .click();
  const form = items()[0].children.at(-1),
    [field] = form.children;
  field.value = ' bucket ';
  page.point('submit', form);
  assert.deepEqual(page.posted('model'), [{discard: 'live object 1'}, {call: 'live object 1', name: 'bucket'}]);
  page.hear({live: {'live object 10': thing('tracked')}});
  assert.match(items()[2].textContent, /Keep/, 'by their numbers');
  page.hear({live: {'live object 10': null, 'live object 2': thing('discarded')}});
  assert.equal(items()[0].children.at(-1), form, 'a form in which somebody types stays while others change');
  assert.deepEqual(buttons(items()[1]), ['Follow again']);
  page.hear({live: {'live object 1': null, 'live object 2': null}});
  assert.ok(page.byId('live-things').hidden);
});

test('a hidden page follows nothing; shown again it follows again', async () => {
  const page = await open(),
    sockets = page.window.sockets.length;
  const turn = hidden => {
    page.document.hidden = hidden;
    page.point('visibilitychange', page.document);
  };
  assert.equal(page.byId('main-view').dataset.stream, 'stream/main');
  turn(true);
  assert.equal(page.socket.readyState, 3);
  assert.equal(page.byId('main-view').dataset.stream, '');
  await page.clock.advance(20_000);
  assert.equal(page.window.sockets.length, sockets);
  turn(false);
  assert.equal(page.window.sockets.length, sockets + 1);
});
