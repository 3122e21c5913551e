'use strict';
// The operator's page: shows the viewer's state, posts commands. The state's fields are in page_state.cpp, how it comes in stream.js.
// The texts are in language.js, the stop in stop.js, the views in views.js, the session in session.js.

const fixed = (value, digits, unit = '') =>
  value === null || value === undefined ? '–' : number(value, digits) + unit;
const duration = s =>
  s === null
    ? '–'
    : s < 0.001
      ? number(s * 1e6, 0) + ' µs'
      : s < 1
        ? number(s * 1e3, s < 0.01 ? 2 : 0) + ' ms'
        : number(s, 1) + ' s';

let state = null;
let lastHeard = 0,
  lastPolled = 0; // of the viewer; ms, as performance.now()
let torqueScale = 1;

function take(newest) {
  state = newest;
  show();
}

const stream = (operatorPage.stream = new Stream(kStreams.replace(/^http/, 'ws') + 'scene', {
  state: take,
  heard: () => {
    lastHeard = performance.now();
  },
  still: () => showBanner(),
  closed: code => {
    if (code === kSessionEnded) askSession();
  },
}));

// A viewer that was started anew may have its streams on another port, which only its page tells.
const kFind_ms = 3000;
async function findStreams() {
  if (performance.now() - (findStreams.asked ?? 0) < kFind_ms) return;
  findStreams.asked = performance.now();
  const page = await (await fetch('.', {signal: within(1000), cache: 'no-store'})).text();
  const port = /name="stream-port" content="(\d+)"/.exec(page)?.[1];
  if (port && port !== document.querySelector('meta[name=stream-port]').content) location.reload();
}

// Polls the state while nothing comes by the stream: its port may not be reachable, or its viewer gone.
const kPoll_ms = 250,
  kStreamPatience_ms = 1000,
  kSessionEnded = 4001;
async function pollState() {
  for (; ; await pause(kPoll_ms)) {
    if (
      document.hidden ||
      (!stream.still && performance.now() - Math.max(stream.heard, stream.since) < kStreamPatience_ms)
    )
      continue;
    try {
      const response = await fetch('state', {signal: within(1000), cache: 'no-store'});
      if (response.ok) {
        lastHeard = lastPolled = performance.now();
        take(await response.json());
        await findStreams();
      } else if (response.status === 401 && !loggedOut()) await askSession();
    } catch (problem) {
      /* showBanner() reports it */
    }
  }
}

function showBanner() {
  const now = performance.now(),
    silent = now - lastHeard > 2000,
    still = stream.still && now - lastPolled > 1000;
  const words =
    silent || (still && loggedOut())
      ? text(loggedOut() ? 'page.not_logged_in' : 'page.no_connection')
      : still
        ? text('page.still')
        : state
          ? said(state.banner_words, state.banner)
          : '';
  put('banner', words);
  byId('banner').hidden = !words;
}

function show() {
  showBanner();
  const {link, percept, view, viewer} = state;
  put('cell', state.cell);
  for (const [side, name] of [
    ['slave', link.slave],
    ['master', link.master],
  ]) {
    const id = side + '-state';
    put(id, text('link_state.' + name));
    byId(id).title = text('link_tip.' + name);
    byId(id).className = 'state ' + name;
  }
  put('pose-age', duration(link.slave_age_s));
  put('round-trip', duration(link.round_trip_s));
  put('quality', link.quality === null ? '–' : number(Math.floor(link.quality * 1000) / 10, 1) + ' %');
  put('voxel-error', state.model.voxel_error_m === null ? '–' : number(state.model.voxel_error_m * 1e3, 1) + ' mm');
  put('reach', link.reach < 0 ? '–' : String(link.reach));
  put('viewer-rate', fixed(viewer.frames_per_s, 1, '/s'));
  byId('viewer-rate').title = viewer.graphics;
  showPercept(percept, link);
  showJoints(state.joints);
  showCommands(link, view, viewer);
  showGripper(state.gripper);
  byId('carried').hidden = !state.carried;
  put('carried', state.carried_words.map(words => said(words)).join(', '));
  showObjects(state.objects);
  showDoubts(state.doubts ?? {}, state.findings ?? {}, state.model.undo);
  showThings(state.live ?? {});
  showViews(view, viewer);
  showHits(listedHits(state), state.total_hits);
  takeAlarms(listedHits(state), percept.threats ?? []);
  showThreats(percept);
  showDelays(state);
  showWhy(state.limits_words ?? []);
  byId('main-view').style.setProperty('--strip', viewer.gauges_share ?? 0);
  showComponents(
    Object.keys(state.components)
      .sort()
      .map(name => state.components[name])
      .filter(Boolean),
  );
  document.dispatchEvent(new CustomEvent('state', {detail: state})); // review.js
}

// The percepts in the order of the bits of set_percepts, and which of them the operator has chosen.
const kPercepts = ['drag', 'tone', 'views'];
const kPerceptKeys = {D: 'drag', M: 'tone', V: 'views', L: 'by-law'}; // the buttons that they press
function chosenPercepts(link) {
  return {drag: link.drag_chosen, tone: link.tone_enabled, views: link.views_enabled};
}

const kNodeOrder = [0, 9, 10, 11, 12, 13, 14, 1, 2, 3, 4, 5, 6, 7, 8]; // by itself, the faces, the corners
const kCommanding =
  '#commands button, #commands input, #gripper button, #stop, #stop-reset, #node, #hold, #approach, #calibrate, [data-tools] button';
function showCommands(link, view, viewer) {
  for (const e of document.querySelectorAll(kCommanding))
    e.disabled =
      !viewer.allow_commands || (e.id !== 'stop' && !may(e.closest('[data-role]')?.dataset.role ?? 'operate'));
  if (!viewer.allow_commands) say(text('command.switched_off'), false);
  const gain = fixed(link.percept_gain, 2),
    feedback = fixed(link.feedback_gain, 3);
  put(
    'gain-now',
    link.percept_limited
      ? text('percept.limited', {value: gain})
      : link.percept_capped
        ? text('percept.capped', {value: gain})
        : gain,
  );
  put(
    'feedback-now',
    link.feedback_damped
      ? text('percept.damped', {value: feedback})
      : link.feedback_capped
        ? text('percept.capped', {value: feedback})
        : link.force_missing
          ? text('percept.no_force_sensor', {value: feedback})
          : feedback,
  );
  if (link.law !== null) setChoice(byId('law'), String(link.law));
  for (const id of kPercepts) byId(id).setAttribute('aria-pressed', chosenPercepts(link)[id]);
  byId('by-law').setAttribute('aria-pressed', link.percept_set_automatic);
  byId('counterbalance').setAttribute('aria-pressed', link.counterbalance === 'automatic');
  byId('counterbalance').hidden = link.counterbalance === 'mechanical';
  put('percepts', said(link.percepts_words));
  byId('hold').setAttribute('aria-pressed', view.hold);
  byId('approach').setAttribute('aria-pressed', Boolean(view.approach));
  showViewTools(view, viewer);
  offerChoice(
    byId('node'),
    kNodeOrder
      .filter(number => number in (view.directions ?? {}))
      .map(number => [String(number), said(view.directions[number])]),
  );
  setChoice(byId('node'), String(view.chosen));
}

const kDrawerKeys = {O: 'settings', I: 'system', J: 'history', '?': 'keys'};
// Letter and digit keys work unless text is being typed.
addEventListener('keydown', event => {
  if (event.ctrlKey || event.altKey || event.metaKey || /^(INPUT|TEXTAREA)$/.test(event.target.tagName)) return;
  const key = event.key.toUpperCase();
  if (key === 'H') toggleHold();
  else if (key === 'G' && !event.repeat) toggleApproach();
  else if (key === 'R') toggleRecording(document.activeElement.dataset.view ?? 'main');
  else if (key in kPerceptKeys && !event.repeat) byId(kPerceptKeys[key]).click();
  else if (key === 'Q') acknowledgeAlarm();
  else if (key === 'X') setLarge(layout.large === focusedView() ? 'main' : focusedView());
  else if (key === 'Z') toggleEnlarged();
  else if (key === 'P') detach(focusedView());
  else if (key in kDrawerKeys && !event.repeat) openDrawer(kDrawerKeys[key], document.activeElement);
  else if (key in kNodes) command('view_node', kNodes[key]);
  else if (/^[1-8]$/.test(key)) command('view_node', +key);
});

function say(text, bad) {
  put('answer', text);
  byId('answer').className = bad ? 'bad' : '';
}

function command(kind, value) {
  return post('command', value === undefined ? {kind} : {kind, value}, text('command_name.' + kind));
}

// Posts a request. Reports its outcome if it has a name, and always why it was not carried out.
async function post(path, body, name) {
  try {
    const response = await fetch(path, {
      method: 'POST',
      headers: {'Content-Type': 'application/json'},
      body: JSON.stringify(body),
    });
    const answer = await response.json();
    if (response.status === 504)
      say(text('command.not_confirmed', {name: name ?? text('command_name.view'), message: answer.message}), true);
    else if (!answer.ok) say(text('command.refused', {message: answer.message}), true);
    else if (name) say(text('command.answer', {name, message: answer.message}), false);
  } catch (problem) {
    say(text('command.not_sent', {problem: problem.message}), true);
  }
}

// The question is asked in the page: a dialog of the browser's would take the keys, Esc among them, and hold up the scripts.
function askReset(asked) {
  const had = !byId('reset-question').hidden;
  byId('reset-question').hidden = !asked;
  if (asked) byId('reset-no').focus();
  else if (had) byId('reset').focus();
}
byId('reset').addEventListener('click', () => askReset(true));
byId('stop-reset').addEventListener('click', () => {
  if (byId('settings').hidden) openDrawer('settings', byId('stop-reset'));
  askReset(true);
});
byId('reset-no').addEventListener('click', () => askReset(false));
byId('reset-yes').addEventListener('click', () => {
  askReset(false);
  command('reset');
});
byId('reset-question').addEventListener('keydown', event => {
  if (event.key === 'Escape') askReset(false);
});
for (const pressed of kPercepts) {
  byId(pressed).addEventListener('click', () => {
    const chosen = chosenPercepts(state.link);
    chosen[pressed] = !chosen[pressed];
    command(
      'set_percepts',
      kPercepts.reduce((sum, id, bit) => sum + (chosen[id] ? 1 << bit : 0), 0),
    );
  });
}
byId('by-law').addEventListener('click', () => command('set_percepts', 8));
byId('counterbalance').addEventListener('click', () =>
  command('counterbalance', state.link.counterbalance === 'automatic' ? 0 : 1),
);
byId('gain-form').addEventListener('submit', event => {
  event.preventDefault();
  command('set_percept_gain', +byId('gain').value);
});
byId('feedback-form').addEventListener('submit', event => {
  event.preventDefault();
  command('set_feedback_gain', +byId('feedback').value);
});
byId('carry-object').addEventListener('change', () => showObjects(state.objects));
for (const act of ['attach', 'release']) {
  byId(act).addEventListener('click', () =>
    post('carry', {object: byId('carry-object').value, attach: act === 'attach'}, text('command_name.' + act)),
  );
}
byId('undo').addEventListener('click', () => post('model', {undo: state.model.undo?.object ?? ''}, text('doubt.undo')));
byId('gripper-open').addEventListener('click', () => command('gripper_width', 1));
byId('gripper-close').addEventListener('click', () => command('gripper_width', 0));
byId('gripper-width-form').addEventListener('submit', event => {
  event.preventDefault();
  command('gripper_width', +byId('gripper-width').value / 1e3);
});
byId('gripper-force-form').addEventListener('submit', event => {
  event.preventDefault();
  command('gripper_force', +byId('gripper-force').value);
});
byId('law').addEventListener('change', () => command('set_law', +byId('law').value));
addEventListener('language', () => (state ? show() : showBanner()));
document.addEventListener('visibilitychange', () => {
  if (document.hidden) {
    stream.stop();
    for (const id of ['main-view', 'hit-view', 'tool-view']) follow(id, '');
  } else {
    stream.start();
  }
});
setInterval(showBanner, 500);
if (!document.hidden) stream.start();
pollState();
