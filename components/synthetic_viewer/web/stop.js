'use strict';
// The stop: requested here, shown by each side's own report. Polls GET /stop on the page's port, so that it depends neither
// on the streams, of which a browser opens six at once, nor on the pictures. The fields are in stop_json().

const kStopPoll_ms = 200, kStopAnswer_ms = 1000, kStopRetry_ms = 300, kRefusal_ms = 10000, kStopStale_ms = 2000;
const kStopUnheard_ms = 600;  // longer than the viewer waits for master and slave
let stops = null;        // newest answer of GET /stop
let stopAnswered = 0;        // when that answer came; ms, as performance.now()
let stopAsked = 0;       // when a stop was pressed that the viewer has not accepted yet; 0: none
let stopRefused = '';    // why the viewer refused it; shown for kRefusal_ms

const byId = id => document.getElementById(id);
const put = (id, text) => { const e = typeof id === 'string' ? byId(id) : id; if (e.textContent !== text) e.textContent = text; };
const pause = ms => new Promise(resolve => setTimeout(resolve, ms));

function within(ms) {
  const controller = new AbortController();
  setTimeout(() => controller.abort(), ms);
  return controller.signal;
}

// Posts the stop until the viewer has accepted it. From then on GET /stop reports its progress.
async function stop() {
  const pressed = stopAsked = performance.now();
  stopRefused = '';
  showStop();
  while (stopAsked === pressed) {
    try {
      const response = await fetch('command', { method: 'POST', headers: { 'Content-Type': 'application/json' },
        body: JSON.stringify({ kind: 'emergency_stop' }), keepalive: true, priority: 'high', signal: within(kStopAnswer_ms) });
      const answer = await response.json();
      if (stopAsked !== pressed) return;
      stopAsked = 0;
      const taken = response.status === 200 || response.status === 409 || response.status === 504;
      stopRefused = taken ? '' : answer.message;
      if (stopRefused) setTimeout(() => { stopRefused = ''; showStop(); }, kRefusal_ms);
      say((taken ? 'Emergency stop: ' : 'STOP REFUSED by the viewer: ') + answer.message, !answer.ok);
      await askStop();
    } catch (problem) {
      await pause(kStopRetry_ms);
    }
    showStop();
  }
}

async function askStop() {
  try {
    const response = await fetch('stop', { signal: within(kStopAnswer_ms), cache: 'no-store' });
    if (!response.ok) return;
    stops = await response.json();
    stopAnswered = performance.now();
  } catch (problem) { /* showBanner() reports it */ }
  showStop();
}

function showSide(name, side) {
  put(`stop-${name}-text`, side ? side.text : 'not known');
  byId(`stop-${name}`).className = 'side ' + (side ? side.level : 'alarm');
}

function showStop() {
  const unheard = stopAsked && performance.now() - stopAsked > kStopUnheard_ms;
  const inForce = Boolean(stops && stops.in_force), stale = performance.now() - stopAnswered > kStopStale_ms;
  const alarm = Boolean(unheard || stopRefused || (inForce && (stops.alarm || stale)));
  byId('stop-board').hidden = !(inForce || stopAsked || stopRefused);
  byId('stop-board').classList.toggle('alarm', alarm);
  put('stop-headline', unheard ? 'STOP NOT SENT: the viewer does not answer. Use the hardware stop.'
    : stopRefused ? `STOP NOT SENT: ${stopRefused}. Use the hardware stop.`
      : inForce && stale ? `${stops.headline}, when last heard: the viewer does not answer`
        : inForce ? stops.headline : 'STOPPING');
  const shown = !unheard && !stopRefused && inForce && !stale;
  byId('stop-sides').hidden = !shown;
  if (shown) for (const name of ['master', 'slave']) showSide(name, stops.sides[name]);
  const notices = stops ? stops.notices : [];
  put('notices', notices.join('\n'));
  byId('notices').hidden = !notices.length;
  const title = document.title.replace(/^⚠ STOP NOT CONFIRMED – /, '');
  document.title = (alarm ? '⚠ STOP NOT CONFIRMED – ' : '') + title;
}

byId('stop').addEventListener('click', stop);
// Esc stops, wherever the focus is. Space does not, because it presses the button that has the focus.
addEventListener('keydown', event => {
  if (event.key !== 'Escape') return;
  event.preventDefault();
  if (!event.repeat) stop();
});
(async () => {
  for (;;) {
    if (!document.hidden) await askStop();
    await pause(kStopPoll_ms);
  }
})();
