'use strict';
// The views: their pictures, their buttons, and how mouse, fingers and keys turn them. Uses page.js's state.

// Streams have their own port, because each occupies a connection: a browser opens at most six per host and port for all its
// windows together, and requests to the page's port must not wait for them. A hidden page closes its streams, and
// the hit zone's stream is open only while there is a zone to show.
const kStreams = `${location.protocol}//${location.hostname}:${document.querySelector('meta[name=stream-port]').content}/`;
const kDrawnHere = new Set(); // the views that scene.js draws in the browser: they need no stream
// Whether a view has a place on this page (layout.js), and is not hidden by the large one.
function isSeen({dataset: {place}}) {
  return place === 'large' || (place !== 'none' && !byId('desk').classList.contains('enlarged'));
}
function follow(id, path) {
  const image = byId(id);
  const wanted =
    path && !document.hidden && isSeen(image.closest('figure')) && !kDrawnHere.has(image.dataset.view) ? path : '';
  if ((image.dataset.stream || '') === wanted || performance.now() < +(image.dataset.retry || 0)) return;
  image.dataset.stream = wanted;
  image.dataset.since = performance.now();
  if (wanted) image.src = kStreams + wanted + '?' + Date.now();
  else image.removeAttribute('src');
}

// What this page and scene.js, which draws the views in the browser, need of each other.
const operatorPage = (window.operatorPage = {
  streams: kStreams,
  drawn: kDrawnHere,
  home: () => false,
  moved: () => undefined, // of the views that are drawn here
  state: () => state,
  heard: () => lastHeard || -Infinity,
  mayOperate: () => may('operate'),
  moveView: request => moveView(request),
  refresh: () => {
    if (state !== null) showViews(state.view, state.viewer);
  },
});

// Returns whether a stream is open but has shown no picture for 3 s.
function withoutPicture(id) {
  const image = byId(id);
  return Boolean(image.dataset.stream) && !image.naturalWidth && performance.now() - +image.dataset.since > 3000;
}

function showViews(view, viewer) {
  byId('tool-figure').hidden = !viewer.tool_view;
  byId('camera-figure').hidden = !viewer.camera;
  showLayout();
  follow('main-view', 'stream/main');
  const image = byId('hit-view');
  const [last] = listedHits(state);
  byId('hit-figure').classList.toggle('threat', view.threatening);
  if (view.alert) {
    follow('hit-view', 'stream/hit');
    put(
      'hit-caption',
      view.gap
        ? text('view.gap', {object: said(view.gap.object_words), gap_mm: view.gap.gap_m * 1e3})
        : text(view.threatening ? 'view.hit_now' : 'view.hit_over', {
            alert: view.alert,
            direction: said(view.direction_words, view.node),
          }),
    );
  } else if (!state.link.views_enabled) {
    image.dataset.stream = '';
    put('hit-caption', text('view.hit_off'));
  } else if (last) {
    image.dataset.stream = '';
    const still = `hits/${last.alert}.jpg`;
    if (!image.src.endsWith(still)) image.src = still;
    put('hit-caption', text('view.hit_first', {alert: last.alert}));
  } else {
    put('hit-caption', text('view.hit'));
  }
  image.classList.toggle('past', !view.alert);
  image.hidden = !view.alert && (!last || !state.link.views_enabled);
  byId('hit-empty').hidden = !image.hidden;
  put('hit-empty', text(state.link.views_enabled ? 'view.none_threatens' : 'view.views_off'));
  follow('tool-view', viewer.tool_view ? 'stream/tool' : '');
  follow('camera-view', viewer.camera ? 'stream/camera' : '');
  if (viewer.camera) put('camera-caption', text('view.camera', {name: viewer.camera}));
}

// The buttons of every view: back to the default camera, and recording.
function viewButton(name, icon) {
  const button = document.createElement('button');
  Object.assign(button, {type: 'button', className: name});
  button.innerHTML = '<span class="icon" aria-hidden="true"></span><span class="label"></span>';
  button.firstChild.textContent = icon;
  return button;
}
for (const tools of document.querySelectorAll('[data-tools]')) {
  const view = tools.dataset.tools;
  const home = viewButton('home', '↺'),
    record = viewButton('record', '●');
  record.setAttribute('aria-pressed', 'false');
  home.addEventListener('click', () => operatorPage.home(view) || moveView({view, home: true}));
  record.addEventListener('click', () => toggleRecording(view));
  tools.append(home, record);
}

function isRecording(view) {
  return state !== null && state.recording.running && state.recording.view === view;
}
function toggleHold() {
  command('view_hold', byId('hold').getAttribute('aria-pressed') === 'true' ? 0 : 1);
}
function toggleApproach() {
  moveView({view: 'hit', approach: !state.view.approach});
}
function toggleRecording(view) {
  moveView({view, record: !isRecording(view)});
}

function showViewTools(view, viewer) {
  for (const tools of document.querySelectorAll('[data-tools]')) {
    const name = tools.dataset.tools,
      home = tools.querySelector('.home'),
      record = tools.querySelector('.record');
    home.hidden = !(operatorPage.moved(name) ?? view.moved[name]);
    home.title = text('view.back_title');
    put(home.lastChild, text('view.back'));
    record.title = text('view.record_title');
    record.setAttribute('aria-pressed', isRecording(name));
    put(record.lastChild, text(isRecording(name) ? 'view.recording' : 'view.record'));
  }
  const {problem, file, running} = state.recording;
  const recorded = problem
    ? text('view.record_problem', {problem})
    : file
      ? text(running ? 'view.recording_to' : 'view.recorded', {file: file.replace(/.*\//, '')})
      : '';
  const alone = withoutPicture('main-view') ? text('view.no_picture') : '';
  put(
    'main-note',
    alone ||
      said(viewer.message_words, viewer.message) ||
      recorded ||
      text(viewer.allow_commands ? 'view.main' : 'view.main_only'),
  );
  byId('main-note').title = file;
}

// Moves a view. Movements that come before the last is answered are combined.
const waiting = {};
async function moveView(request) {
  if (state === null || !state.viewer.allow_commands || !may('operate')) return;
  const next = (waiting[request.view] ??= {view: request.view, orbit_deg: [0, 0], zoom: 1});
  if (request.home) Object.assign(next, {home: true, orbit_deg: [0, 0], zoom: 1});
  if (request.orbit_deg)
    next.orbit_deg = next.orbit_deg.map((a, i) => Math.max(-180, Math.min(180, a + request.orbit_deg[i])));
  if (request.zoom) next.zoom = Math.max(0.1, Math.min(10, next.zoom * request.zoom));
  if (request.record !== undefined) next.record = request.record;
  if (request.approach !== undefined) next.approach = request.approach;
  if (moveView.busy) return;
  moveView.busy = true;
  while (Object.keys(waiting).length) {
    const view = Object.keys(waiting)[0],
      body = waiting[view];
    delete waiting[view];
    await post('view', body);
  }
  moveView.busy = false;
}

// Pointers on a view: one turns it by its way, of two the middle turns it and their distance zooms.
function middleOf(pointers) {
  const at = [...pointers.values()];
  const x = at.reduce((sum, p) => sum + p.x, 0) / at.length,
    y = at.reduce((sum, p) => sum + p.y, 0) / at.length;
  return {x, y, apart: at.length === 2 ? Math.hypot(at[0].x - at[1].x, at[0].y - at[1].y) : 0};
}

function followPointers(image, view) {
  const pointers = new Map(); // id → where it was last
  let tapped = 0; // when a finger last touched and left without moving; ms, as performance.now()
  image.addEventListener('pointerdown', event => {
    if ((event.pointerType === 'mouse' && event.button !== 0) || pointers.size === 2) return;
    pointers.set(event.pointerId, {x: event.clientX, y: event.clientY, moved: false});
    image.setPointerCapture(event.pointerId);
    image.focus({preventScroll: true});
  });
  image.addEventListener('pointermove', event => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    const before = middleOf(pointers),
      scale = 180 / image.clientHeight;
    Object.assign(pointer, {x: event.clientX, y: event.clientY, moved: true});
    const now = middleOf(pointers);
    const request = {view, orbit_deg: [(before.x - now.x) * scale, (now.y - before.y) * scale]};
    if (now.apart > 10 && before.apart > 10) request.zoom = before.apart / now.apart;
    moveView(request);
  });
  const leave = event => {
    const pointer = pointers.get(event.pointerId);
    pointers.delete(event.pointerId);
    if (!pointer || event.pointerType === 'mouse' || event.type !== 'pointerup' || pointer.moved) return;
    const again = performance.now() - tapped < 400;
    tapped = again ? 0 : performance.now();
    if (again) moveView({view, home: true});
  };
  for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) image.addEventListener(end, leave);
  image.addEventListener(
    'wheel',
    event => {
      event.preventDefault();
      moveView({view, zoom: event.deltaY < 0 ? 0.9 : 1 / 0.9});
    },
    {passive: false},
  );
  image.addEventListener('dblclick', () => moveView({view, home: true}));
}

const kKeyTurn_deg = 5,
  kNodes = {A: 0, N: 9, S: 10, E: 11, W: 12, T: 13, B: 14};
for (const image of document.querySelectorAll('.view img'))
  image.addEventListener('error', () => Object.assign(image.dataset, {stream: '', retry: performance.now() + 2000}));
for (const image of document.querySelectorAll('[data-view]')) {
  const {view} = image.dataset;
  image.draggable = false;
  followPointers(image, view);
  image.addEventListener('keydown', event => {
    const turn = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
    if (turn) moveView({view, orbit_deg: turn.map(a => a * kKeyTurn_deg)});
    else if (event.key === '+' || event.key === '=') moveView({view, zoom: 0.9});
    else if (event.key === '-') moveView({view, zoom: 1 / 0.9});
    else if (event.key === 'Home') moveView({view, home: true});
    else return;
    event.preventDefault();
  });
}
byId('hold').addEventListener('click', toggleHold);
byId('approach').addEventListener('click', toggleApproach);
byId('node').addEventListener('change', () => command('view_node', +byId('node').value));
