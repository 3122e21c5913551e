'use strict';
// The operator's page: follows the events, shows the streams, posts commands. The fields of an event are in page_state.cpp.
// The stop is in stop.js, the session in session.js.

const fixed = (value, digits, unit = '') => value === null || value === undefined ? '–' : value.toFixed(digits) + unit;
const duration = s => s === null ? '–' : s < 0.001 ? (s * 1e6).toFixed(0) + ' µs' : s < 1 ? (s * 1e3).toFixed(s < 0.01 ? 2 : 0) + ' ms' : s.toFixed(1) + ' s';

let state = null;
let source = null;
let lastEvent = 0, lastState = 0, connected = 0;
let torqueScale = 1;

// Streams have their own port, because each occupies a connection: a browser opens at most six per host and port for all its
// windows together, and requests to the page's port must not wait for them. A hidden page closes its streams, and
// the hit zone's stream is open only while there is a zone to show.
const kStreams = `${location.protocol}//${location.hostname}:${document.querySelector('meta[name=stream-port]').content}/`;
function follow(id, path) {
  const image = byId(id);
  const wanted = path && !document.hidden ? path : '';
  if ((image.dataset.stream || '') === wanted || performance.now() < +(image.dataset.retry || 0)) return;
  image.dataset.stream = wanted;
  image.dataset.since = performance.now();
  if (wanted) image.src = kStreams + wanted + '?' + Date.now();
  else image.removeAttribute('src');
}

function take(json) { lastState = performance.now(); state = json; show(); }

function connect() {
  if (source) source.close();
  connected = performance.now();
  source = new EventSource(kStreams + 'events', { withCredentials: true });
  source.onmessage = message => { lastEvent = performance.now(); take(JSON.parse(message.data)); };
}

// Polls the state while no events come: other windows occupy the browser's connections, or their port is not reachable.
const kPoll_ms = 250, kEventsPatience_ms = 1000;
async function pollState() {
  for (;; await pause(kPoll_ms)) {
    if (document.hidden || performance.now() - Math.max(lastEvent, connected) < kEventsPatience_ms) continue;
    try {
      const response = await fetch('state', { signal: within(1000), cache: 'no-store' });
      if (response.ok) take(await response.json());
      else if (response.status === 401 && !loggedOut()) await askSession();
    } catch (problem) { /* showBanner() reports it */ }
  }
}

// Returns whether a stream is open but has shown no picture for 3 s.
function withoutPicture(id) {
  const image = byId(id);
  return Boolean(image.dataset.stream) && !image.naturalWidth && performance.now() - +image.dataset.since > 3000;
}

function showBanner() {
  const silent = performance.now() - lastState > 2000;
  const text = silent && loggedOut() ? 'NOT LOGGED IN: only the emergency stop works' : silent ? 'NO CONNECTION TO THE VIEWER: what you see is out of date' : state ? state.banner : '';
  put('banner', text);
  byId('banner').hidden = !text;
}

function show() {
  showBanner();
  const { link, percept, view, viewer } = state;
  put('cell', state.cell);
  put('slave-state', link.slave);
  put('master-state', link.master);
  put('pose-age', duration(link.slave_age_s));
  put('round-trip', duration(link.round_trip_s));
  put('quality', link.quality === null ? '–' : (Math.floor(link.quality * 1000) / 10).toFixed(1) + ' %');
  put('voxel-error', state.model.voxel_size_m === null ? '–' : (state.model.voxel_size_m * Math.sqrt(3) / 2 * 1e3).toFixed(1) + ' mm');
  put('reach', link.reach < 0 ? '–' : String(link.reach));
  put('viewer-rate', fixed(viewer.frames_per_s, 1, ' fps'));
  byId('viewer-rate').title = viewer.graphics;
  showPercept(percept, link);
  showJoints(state.joints);
  showCommands(link, view, viewer);
  showGripper(state.gripper);
  byId('carried').hidden = !state.carried;
  put('carried', state.carried);
  showObjects(state.objects);
  showViews(view, viewer);
  showHits(state.hits, state.total_hits);
  showComponents(state.components);
}

function showBar(id, value, most, grade) {
  const bar = byId(id + '-bar');
  byId(id + '-meter').setAttribute('aria-valuenow', value);
  bar.style.width = Math.max(0, Math.min(1, value / most)) * 100 + '%';
  bar.className = grade > 0.75 ? 'hot' : grade > 0.4 ? 'warm' : '';
}

function showPercept(percept, link) {
  put('closeness', fixed(percept.closeness, 2));
  put('speed', fixed(percept.speed_m_s, 3, ' m/s'));
  showBar('closeness', percept.closeness ?? 0, 1, percept.closeness ?? 0);
  showBar('speed', percept.speed_m_s ?? 0, 0.5, 0);
  put('motion', percept.known ? (percept.motion === 'none' ? 'no direction' : percept.motion) : 'no percept');
  byId('motion').className = 'chip ' + percept.motion;
  put('nearest-link', percept.known ? percept.link || 'all links free' : 'unknown');
  put('nearest-object', percept.known ? percept.object || '–' : '–');
  byId('contact').hidden = !link.contact;
  put('contact', link.contact ? `Contact with ${link.contact_object}` + (link.contact_force_N === null ? '' : `, ${link.contact_force_N.toFixed(1)} N`) : '');
}

function showJoints(joints) {
  const box = byId('joints');
  if (box.childElementCount !== joints.length) {
    box.replaceChildren(...joints.map(joint => {
      const row = document.createElement('div');
      row.className = 'joint';
      row.innerHTML = '<span class="name"></span><span class="twoway"><i class="percept"></i><i class="feedback"></i></span><span class="value"></span>';
      row.querySelector('.name').textContent = joint.name;
      row.title = `${joint.name}, in ${joint.prismatic ? 'N' : 'N·m'}`;
      return row;
    }));
  }
  const largest = Math.max(0, ...joints.flatMap(j => [Math.abs(j.percept_torque), Math.abs(j.feedback_torque)]));
  while (torqueScale < largest) torqueScale *= torqueScale.toString().startsWith('2') ? 2.5 : 2;
  put('torque-scale', `±${torqueScale} N·m or N`);
  joints.forEach((joint, i) => {
    const row = box.children[i];
    row.querySelector('.percept').style.transform = `scaleX(${joint.percept_torque / torqueScale})`;
    row.querySelector('.feedback').style.transform = `scaleX(${joint.feedback_torque / torqueScale})`;
    put(row.querySelector('.value'), (joint.percept_torque + joint.feedback_torque).toFixed(2));
  });
}

// The percepts in the order of the bits of set_percepts, and which of them the operator has chosen.
const kPercepts = ['drag', 'tone', 'views'];
const kPerceptKeys = { D: 'drag', M: 'tone', V: 'views', L: 'by-law' };  // the buttons that they press
function chosenPercepts(link) { return { drag: link.drag_chosen, tone: link.tone_enabled, views: link.views_enabled }; }

function showCommands(link, view, viewer) {
  for (const e of document.querySelectorAll('#commands button, #commands input, #commands select, #stop, #node, #hold, .tools button'))
    e.disabled = !viewer.allow_commands || (e.id !== 'stop' && !may(e.closest('[data-role]')?.dataset.role ?? 'operate'));
  if (!viewer.allow_commands) say('This viewer only shows; commands are switched off in its configuration.', false);
  put('gain-now', fixed(link.percept_gain, 2) + (link.percept_limited ? ' (limited)' : ''));
  put('feedback-now', fixed(link.feedback_gain, 3) + (link.feedback_damped ? ' (damped)' : link.force_missing ? ' (no force sensor)' : ''));
  if (document.activeElement !== byId('law') && link.law !== null) byId('law').value = link.law;
  for (const id of kPercepts) byId(id).setAttribute('aria-pressed', chosenPercepts(link)[id]);
  byId('by-law').setAttribute('aria-pressed', link.percept_set_automatic);
  byId('counterbalance').setAttribute('aria-pressed', link.counterbalance === 'automatic');
  byId('counterbalance').hidden = link.counterbalance === 'mechanical';
  put('percepts', link.percepts);
  byId('hold').setAttribute('aria-pressed', view.hold);
  showViewTools(view, viewer);
  if (document.activeElement !== byId('node')) byId('node').value = view.chosen;
}

// The choice stays while the list is the same.
function showObjects(objects) {
  const choice = byId('carry-object');
  const named = objects.map(o => o.name + (o.carried ? ' (carried)' : ''));
  if (named.join('\n') !== [...choice.options].map(o => o.text).join('\n')) {
    const chosen = choice.value;
    choice.replaceChildren(...objects.map((o, i) => new Option(named[i], o.name)));
    if (objects.some(o => o.name === chosen)) choice.value = chosen;
  }
  const object = objects.find(o => o.name === choice.value);
  byId('attach').hidden = object !== undefined && object.carried;
  byId('release').hidden = object === undefined || !object.carried;
}

function showGripper(gripper) {
  byId('gripper').hidden = !gripper;
  if (!gripper) return;
  put('gripper-words', gripper.words);
  byId('gripper-words').className = gripper.fault || gripper.width_m === null ? 'bad' : '';
  put('gripper-force-now', fixed(gripper.requested_force_N, 1, ' N'));
  byId('gripper-width').max = gripper.widest_m * 1e3;
  byId('gripper-force').min = gripper.least_force_N;
  byId('gripper-force').max = gripper.greatest_force_N;
}

function showViews(view, viewer) {
  follow('main-view', 'stream/main');
  const image = byId('hit-view');
  const last = state.hits[0];
  byId('hit-figure').classList.toggle('threat', view.threatening);
  if (view.alert) {
    follow('hit-view', 'stream/hit');
    put('hit-caption', `Alert ${view.alert}, from ${view.node}${view.threatening ? '' : ', over'}`);
  } else if (!state.link.views_enabled) {
    image.dataset.stream = '';
    put('hit-caption', 'Hit zone: views are off');
  } else if (last) {
    image.dataset.stream = '';
    const still = `hits/${last.alert}.jpg`;
    if (!image.src.endsWith(still)) image.src = still;
    put('hit-caption', `Alert ${last.alert}, over: first picture`);
  } else {
    put('hit-caption', 'Hit zone');
  }
  image.classList.toggle('past', !view.alert);
  image.hidden = !view.alert && (!last || !state.link.views_enabled);
  byId('hit-empty').hidden = !image.hidden;
  put('hit-empty', state.link.views_enabled ? 'No hit threatens. When one does, its zone appears here.'
    : 'Views are off: alerts are listed, but not shown. Hold shows the zone that threatens.');
  byId('tool-figure').hidden = !viewer.tool_view;
  follow('tool-view', viewer.tool_view ? 'stream/tool' : '');
}

// The buttons of every view: back to the default camera, and recording.
for (const tools of document.querySelectorAll('[data-tools]')) {
  const view = tools.dataset.tools;
  tools.innerHTML = '<button type="button" class="home" title="Back to where it stands by itself. Key: Home">Back</button>'
    + '<button type="button" class="record" aria-pressed="false" title="Record this view as a video. Key: R">Record</button>';
  tools.querySelector('.home').addEventListener('click', () => moveView({ view, home: true }));
  tools.querySelector('.record').addEventListener('click', () => toggleRecording(view));
}

function isRecording(view) { return state !== null && state.recording.running && state.recording.view === view; }
function toggleHold() { command('view_hold', byId('hold').getAttribute('aria-pressed') === 'true' ? 0 : 1); }
function toggleRecording(view) { moveView({ view, record: !isRecording(view) }); }

function showViewTools(view, viewer) {
  for (const tools of document.querySelectorAll('[data-tools]')) {
    const name = tools.dataset.tools;
    tools.querySelector('.home').hidden = !view.moved[name];
    const record = tools.querySelector('.record');
    record.setAttribute('aria-pressed', isRecording(name));
    put(record, isRecording(name) ? 'Recording' : 'Record');
  }
  const { recording } = state;
  const recorded = recording.problem ? 'Recording: ' + recording.problem
    : recording.file ? (recording.running ? 'Recording to ' : 'Recorded: ') + recording.file : '';
  const alone = withoutPicture('main-view')
    ? 'No live picture: this browser follows six streams at once, all its windows together. Close one of them.' : '';
  put('main-note', alone || viewer.message || recorded || (viewer.allow_commands ? 'Drag to turn, wheel to zoom' : ''));
}

// Moves a view. Movements that come before the last is answered are combined.
const waiting = {};
async function moveView(request) {
  if (state === null || !state.viewer.allow_commands || !may('operate')) return;
  const next = waiting[request.view] ??= { view: request.view, orbit_deg: [0, 0], zoom: 1 };
  if (request.home) Object.assign(next, { home: true, orbit_deg: [0, 0], zoom: 1 });
  if (request.orbit_deg) next.orbit_deg = next.orbit_deg.map((a, i) => Math.max(-180, Math.min(180, a + request.orbit_deg[i])));
  if (request.zoom) next.zoom = Math.max(0.1, Math.min(10, next.zoom * request.zoom));
  if (request.record !== undefined) next.record = request.record;
  if (moveView.busy) return;
  moveView.busy = true;
  while (Object.keys(waiting).length) {
    const view = Object.keys(waiting)[0], body = waiting[view];
    delete waiting[view];
    await post('view', body);
  }
  moveView.busy = false;
}

const kKeyTurn_deg = 5, kNodes = { A: 0, N: 9, S: 10, E: 11, W: 12, T: 13, B: 14 };
for (const image of document.querySelectorAll('[data-view]')) {
  const { view } = image.dataset;
  image.draggable = false;
  image.addEventListener('error', () => Object.assign(image.dataset, { stream: '', retry: performance.now() + 2000 }));
  let from = null;
  image.addEventListener('pointerdown', event => {
    if (event.button !== 0) return;
    from = event;
    image.setPointerCapture(event.pointerId);
    image.focus();
  });
  image.addEventListener('pointermove', event => {
    if (!from || !image.hasPointerCapture(event.pointerId)) return;
    const scale = 180 / image.clientHeight;
    moveView({ view, orbit_deg: [(from.clientX - event.clientX) * scale, (event.clientY - from.clientY) * scale] });
    from = event;
  });
  image.addEventListener('wheel', event => {
    event.preventDefault();
    moveView({ view, zoom: event.deltaY < 0 ? 0.9 : 1 / 0.9 });
  }, { passive: false });
  image.addEventListener('dblclick', () => moveView({ view, home: true }));
  image.addEventListener('keydown', event => {
    const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (turn) moveView({ view, orbit_deg: turn.map(a => a * kKeyTurn_deg) });
    else if (event.key === '+' || event.key === '=') moveView({ view, zoom: 0.9 });
    else if (event.key === '-') moveView({ view, zoom: 1 / 0.9 });
    else if (event.key === 'Home') moveView({ view, home: true });
    else return;
    event.preventDefault();
  });
}
// Letter and digit keys work unless text is being typed.
addEventListener('keydown', event => {
  if (event.ctrlKey || event.altKey || event.metaKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
  const key = event.key.toUpperCase();
  if (key === 'H') toggleHold();
  else if (key === 'R') toggleRecording(document.activeElement.dataset.view ?? 'main');
  else if (key in kPerceptKeys && !event.repeat) byId(kPerceptKeys[key]).click();
  else if (key in kNodes) command('view_node', kNodes[key]);
  else if (/^[1-8]$/.test(key)) command('view_node', +key);
});

const kRules = { very_close: 'very close', moderate_moving: 'moving in the vicinity', far_nearing: 'nearing', none: '' };

function showHits(hits, total) {
  put('hit-count', String(total));
  const list = byId('hits');
  const key = hits.map(h => h.alert + (h.cleared_after_s === null ? '!' : '')).join();
  if (list.dataset.key === key && list.childElementCount) return;
  list.dataset.key = key;
  if (!hits.length) list.innerHTML = '<li class="none">None so far.</li>';
  else list.replaceChildren(...hits.map(hit => {
    const item = document.createElement('li');
    item.className = hit.cleared_after_s === null ? 'threatening' : '';
    item.innerHTML = '<a target="_blank"><img loading="lazy" alt=""></a><div><div class="what"></div><div class="why"></div></div>';
    item.querySelector('a').href = item.querySelector('img').src = `hits/${hit.alert}.jpg`;
    item.querySelector('img').addEventListener('error', () => { item.querySelector('a').hidden = true; });  // none was made without views
    item.querySelector('a').setAttribute('aria-label', `Picture of alert ${hit.alert}`);
    item.querySelector('.what').textContent = `${hit.link} → ${hit.object}`;
    const over = hit.cleared_after_s === null ? 'threatens' : `over after ${duration(hit.cleared_after_s)}`;
    item.querySelector('.why').textContent = `#${hit.alert} at ${hit.t.toFixed(1)} s, ${kRules[hit.rule]}, ${hit.speed_m_s.toFixed(2)} m/s, ${over}`;
    return item;
  }));
}

// The rate of a hanging loop is out of date, so the time since its last tick is shown instead.
function rate(loop) {
  return loop.idle_s > 1 + 3 / loop.nominal_hz ? `no tick for ${loop.idle_s.toFixed(0)} s` : fixed(loop.rate_hz, loop.rate_hz >= 100 ? 0 : 1, ' Hz');
}

function showComponents(components) {
  const rows = [];
  for (const c of components) {
    const row = document.createElement('tr');
    const loop = c.loops[0];
    const cells = [[c.simulated ? `${c.name} (simulated)` : c.name, ''], [c.state, 'state ' + c.state], [loop ? rate(loop) : '–', 'number'],
      [loop ? duration(loop.p99_us * 1e-6) : '–', 'number'], [`${c.refused} / ${c.deadline_missed}`, 'number']];
    for (const [text, kind] of cells) {
      const cell = document.createElement('td');
      cell.textContent = text;
      if (kind) cell.className = kind;
      row.append(cell);
    }
    row.title = c.host + c.loops.map(l => `\n${l.name}: ${rate(l)}, ${l.slips} slips`).join('');
    rows.push(row);
    if (c.message) {
      row.className = 'with-message';
      const note = document.createElement('tr');
      note.innerHTML = '<td class="message" colspan="5"></td>';
      note.firstChild.textContent = c.message;
      rows.push(note);
    }
  }
  byId('components').replaceChildren(...rows);
}

function say(text, bad) {
  put('answer', text);
  byId('answer').className = bad ? 'bad' : '';
}

function command(kind, value) {
  return post('command', value === undefined ? { kind } : { kind, value }, kind.replaceAll('_', ' '));
}

// Posts a request. Reports its outcome if it has a name, and always why it was not carried out.
async function post(path, body, name) {
  try {
    const response = await fetch(path, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) });
    const answer = await response.json();
    if (response.status === 504) say(`Not confirmed: ${name}: ${answer.message}`, true);
    else if (!answer.ok) say(`Refused: ${answer.message}`, true);
    else if (name) say(`${name}: ${answer.message}`, false);
  } catch (problem) {
    say(`Not sent: the viewer does not answer (${problem.message})`, true);
  }
}

byId('reset').addEventListener('click', () => { if (confirm('Reset: the arm may move again. Is the cell clear?')) command('reset'); });
for (const pressed of kPercepts) {
  byId(pressed).addEventListener('click', () => {
    const chosen = chosenPercepts(state.link);
    chosen[pressed] = !chosen[pressed];
    command('set_percepts', kPercepts.reduce((sum, id, bit) => sum + (chosen[id] ? 1 << bit : 0), 0));
  });
}
byId('by-law').addEventListener('click', () => command('set_percepts', 8));
byId('counterbalance').addEventListener('click', () => command('counterbalance', state.link.counterbalance === 'automatic' ? 0 : 1));
byId('hold').addEventListener('click', toggleHold);
byId('node').addEventListener('change', () => command('view_node', +byId('node').value));
byId('gain-form').addEventListener('submit', event => { event.preventDefault(); command('set_percept_gain', +byId('gain').value); });
byId('feedback-form').addEventListener('submit', event => { event.preventDefault(); command('set_feedback_gain', +byId('feedback').value); });
byId('carry-object').addEventListener('change', () => showObjects(state.objects));
for (const act of ['attach', 'release']) {
  byId(act).addEventListener('click', () => post('carry', { object: byId('carry-object').value, attach: act === 'attach' }, act));
}
byId('gripper-open').addEventListener('click', () => command('gripper_width', 1));
byId('gripper-close').addEventListener('click', () => command('gripper_width', 0));
byId('gripper-width-form').addEventListener('submit', event => { event.preventDefault(); command('gripper_width', +byId('gripper-width').value / 1e3); });
byId('gripper-force-form').addEventListener('submit', event => { event.preventDefault(); command('gripper_force', +byId('gripper-force').value); });
byId('law').addEventListener('change', () => { command('set_law', +byId('law').value); byId('law').blur(); });
document.addEventListener('visibilitychange', () => {
  if (document.hidden) {
    source.close();
    for (const id of ['main-view', 'hit-view', 'tool-view']) follow(id, '');
  } else {
    connect();
  }
});
setInterval(showBanner, 500);
setInterval(() => { if (!document.hidden && source && source.readyState === EventSource.CLOSED) connect(); }, 1500);
connect();
pollState();
