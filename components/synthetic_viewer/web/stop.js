'use strict';
// The stop: requested here, shown by each side's own report. Polls GET /stop on the page's port, so that it depends neither
// on the streams, of which a browser opens six at once, nor on the pictures. The fields are in stop_json().

const kStopPoll_ms = 200,
  kStopAnswer_ms = 1000,
  kStopRetry_ms = 300,
  kRefusal_ms = 10000,
  kStopStale_ms = 2000;
const kStopUnheard_ms = 600; // longer than the viewer waits for master and slave
let stops = null; // newest answer of GET /stop
let stopAnswered = 0; // when that answer came; ms, as performance.now()
let stopAsked = 0; // when a stop was pressed that the viewer has not accepted yet; 0: none
let stopRefused = ''; // why the viewer refused it; shown for kRefusal_ms

// Should language.js be missing, the stop still works: it is then told by keys.
if (typeof globalThis.text !== 'function')
  Object.assign(globalThis, {text: key => key, said: (words, english) => english});

const byId = id => document.getElementById(id);
const put = (id, text) => {
  const e = typeof id === 'string' ? byId(id) : id;
  if (e.textContent !== text) e.textContent = text;
};
const pause = ms => new Promise(resolve => setTimeout(resolve, ms));

function within(ms) {
  const controller = new AbortController();
  setTimeout(() => controller.abort(), ms);
  return controller.signal;
}

// Posts the stop until the viewer has accepted it. From then on GET /stop reports its progress.
async function stop() {
  const pressed = (stopAsked = performance.now());
  stopRefused = '';
  showStop();
  while (stopAsked === pressed) {
    try {
      const response = await fetch('command', {
        method: 'POST',
        headers: {'Content-Type': 'application/json'},
        body: JSON.stringify({kind: 'emergency_stop'}),
        keepalive: true,
        priority: 'high',
        signal: within(kStopAnswer_ms),
      });
      const answer = await response.json();
      if (stopAsked !== pressed) return;
      stopAsked = 0;
      const taken = response.status === 200 || response.status === 409 || response.status === 504;
      stopRefused = taken ? '' : answer.message;
      if (stopRefused)
        setTimeout(() => {
          stopRefused = '';
          showStop();
        }, kRefusal_ms);
      say(text(taken ? 'stop.answer' : 'stop.refused_answer', {message: answer.message}), !answer.ok);
      await askStop();
    } catch (problem) {
      await pause(kStopRetry_ms);
    }
    showStop();
  }
}

async function askStop() {
  try {
    const response = await fetch('stop', {signal: within(kStopAnswer_ms), cache: 'no-store'});
    if (!response.ok) return;
    stops = await response.json();
    stopAnswered = performance.now();
  } catch (problem) {
    /* showBanner() reports it */
  }
  showStop();
}

function showSide(name, side) {
  put(`stop-${name}-text`, side ? said(side.text_words, side.text) : text('stop.unknown'));
  byId(`stop-${name}`).className = 'side ' + (side ? side.level : 'alarm');
}

function showStop() {
  const unheard = stopAsked && performance.now() - stopAsked > kStopUnheard_ms;
  const inForce = Boolean(stops && stops.in_force),
    stale = performance.now() - stopAnswered > kStopStale_ms;
  const alarm = Boolean(unheard || stopRefused || (inForce && (stops.alarm || stale)));
  byId('stop-board').hidden = !(inForce || stopAsked || stopRefused);
  byId('stop-board').classList.toggle('alarm', alarm);
  const headline = inForce ? said(stops.headline_words, stops.headline) : text('stop_headline.stopping');
  put(
    'stop-headline',
    unheard
      ? text('stop.not_sent')
      : stopRefused
        ? text('stop.refused', {message: stopRefused})
        : inForce && stale
          ? text('stop.stale', {headline})
          : headline,
  );
  const shown = !unheard && !stopRefused && inForce && !stale;
  byId('stop-sides').hidden = !shown;
  if (shown) for (const name of ['master', 'slave']) showSide(name, stops.sides[name]);
  const notices = stops ? stops.notices.map((notice, i) => said(stops.notices_words[i], notice)) : [];
  put('notices', notices.join('\n'));
  byId('notices').hidden = !notices.length;
  document.title = alarm ? text('page.warning_in_title', {title: text('page.title')}) : text('page.title');
}

byId('stop').addEventListener('click', stop);
// Esc stops, wherever the focus is, before anything in the page sees the key. Space does not, because it presses the button
// that has the focus.
addEventListener(
  'keydown',
  event => {
    if (event.key !== 'Escape') return;
    event.preventDefault();
    if (!event.repeat) stop();
  },
  {capture: true},
);
addEventListener('language', showStop);
(async () => {
  for (;;) {
    if (!document.hidden) await askStop();
    await pause(kStopPoll_ms);
  }
})();
