'use strict';
// A recorded session on the page: the bar with the time line, and the plots that go with the pictures. Does nothing on a live
// page. The newest position is in the state's `review`; what the recording has comes once, by GET /review. Fields: page_review.cpp.

(() => {
const kKeys = [['space', 'play'], [', .', 'step'], ['[ ]', 'alert'], ['< >', 'rate'], ['← →', 'arrows'], ['+ −', 'zoom'], ['|← →|', 'ends']];
const kRates = [0.1, 0.2, 0.5, 1, 2, 5, 10];
const kAlertEntered_s = 0.02;  // after an alert came, the percept that it rests on is there, too
const kPlotColours = ['#56b4e9', '#e69f00', '#2fbf8f', '#f0e442', '#d58bb5', '#ee7733', '#8aa0ff', '#c3ccd5'];
const kStateColours = ['#5d6873', '#4fa3e3', '#9b8cf0', '#46a758', '#f0a028', '#e5484d'];  // by number of link state
const kRuleColours = { very_close: '#e5484d', moderate_moving: '#f0a028', far_nearing: '#f0e442', none: '#8d99a6' };
const kPlotHeight = { closeness: 50, speed: 50, percept: 82, feedback: 82, link: 56 };
const kLeft = 46, kRight = 8, kConnected_s = 0.3, kShortest_s = 0.2;

let facts = null;        // newest answer of GET /review; null: not asked yet
let position = null;     // newest position of the viewer
let wantedTime = null;   // where this page asked to go, until the viewer is there
let stretch = [0, 1];    // what the plots show, in s
let columns = null;      // newest answer of GET /review/series

const clock = ms => new Date(ms).toISOString().replace('T', ' ').slice(0, 19) + ' UTC';
const shownTime = () => wantedTime ?? (position ? position.t : 0);
const clampTime = t => Math.max(0, Math.min(facts.duration_s, t));
function alertWords(mark) {
  const over = mark.cleared_t === null ? '' : text('review.over', { time: duration(mark.cleared_t - mark.t) });
  return text('review.mark', { alert: mark.alert, at: mark.t, link: mark.interest_point || mark.link, object: mark.object,
    rule: text('rule.' + mark.rule), speed: mark.speed_m_s, over });
}

function make(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

// ---- requests ----

// Sends one request after the other: two that are on their way together may arrive in either order.
let sending = Promise.resolve();
const send = body => (sending = sending.then(() => post('review', body)));

// Goes to a time. Requests that come while one is on its way are combined: the newest wins.
async function goTo(t) {
  wantedTime = clampTime(t);
  drawAll();
  if (goTo.busy) return;
  goTo.busy = true;
  for (let sent = null; wantedTime !== null && sent !== wantedTime;) {
    sent = wantedTime;
    await send({ t: Math.round(sent * 1e6) / 1e6 });
  }
  goTo.busy = false;
  const last = wantedTime;
  setTimeout(() => { if (wantedTime === last && !goTo.busy) wantedTime = null; }, 1000);  // if no state says that the viewer is there
}

const playing = () => position !== null && position.playing;
function togglePlay() { send({ play: !playing() }); }
let wantedRate = null;  // what this page asked for, until the viewer has it
function setRate(rate) {
  wantedRate = rate;
  send({ rate });
}
function stepRate(by) {
  const at = kRates.findIndex(rate => rate >= (wantedRate ?? position?.rate ?? 1) - 1e-9);
  setRate(kRates[Math.max(0, Math.min(kRates.length - 1, at + by))]);
}
function markAfter(by) {
  const t = shownTime();
  return by > 0 ? facts.alerts.find(mark => mark.t + kAlertEntered_s > t + 5e-4) : facts.alerts.findLast(mark => mark.t + kAlertEntered_s < t - 5e-4);
}
function stepAlert(by) {
  const mark = markAfter(by);
  if (mark) goToMark(mark);
}
function goToMark(mark) {
  const t = mark.t + kAlertEntered_s;
  if (t < stretch[0] || t > stretch[1]) moveStretch(t - (stretch[1] - stretch[0]) / 2);
  goTo(t);
}

let asked = 0;
async function askColumns() {
  const width = Math.max(50, Math.round(byId('review-plots').clientWidth - kLeft - kRight));
  const mine = ++asked;
  await pause(60);
  if (mine !== asked) return;
  const names = facts.series.map(one => one.name).join(',');
  try {
    const response = await fetch(`review/series?names=${names}&from=${stretch[0]}&to=${stretch[1]}&columns=${width}`, { signal: within(3000), cache: 'no-store' });
    if (!response.ok || mine !== asked) return;
    columns = await response.json();
    drawAll();
  } catch (problem) { /* showBanner() reports it */ }
}

// ---- the stretch that the plots show ----

function moveStretch(from, length = stretch[1] - stretch[0]) {
  const whole = facts.duration_s;
  const long = Math.max(Math.min(kShortest_s, whole), Math.min(whole, length));
  const begin = Math.max(0, Math.min(whole - long, from));
  stretch = [begin, begin + long];
  askColumns();
  drawAll();
}
function zoomStretch(factor, about = shownTime()) {
  moveStretch(about - (about - stretch[0]) * factor, (stretch[1] - stretch[0]) * factor);
}

// ---- drawing ----

// Returns a canvas's context in CSS pixels, cleared.
function begun(canvas) {
  const scale = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * scale)) canvas.width = Math.round(width * scale);
  if (canvas.height !== Math.round(height * scale)) canvas.height = Math.round(height * scale);
  const g = canvas.getContext('2d');
  g.setTransform(scale, 0, 0, scale, 0, 0);
  g.clearRect(0, 0, width, height);
  g.font = '11px system-ui, "DejaVu Sans", sans-serif';
  return { g, width, height };
}

// Returns round numbers within [least, most], about `count` of them.
function ticks(least, most, count) {
  const rough = (most - least) / count, unit = 10 ** Math.floor(Math.log10(rough));
  const step = unit * [1, 2, 5, 10].find(f => unit * f >= rough * 0.999);
  const list = [];
  for (let k = Math.ceil(least / step - 1e-9); k * step <= most + 1e-9 * step; ++k) list.push(+(k * step).toPrecision(10));
  return list;
}
const tickText = t => t >= 60 ? `${Math.floor(t / 60)}:${(t % 60).toFixed(t % 1 ? 1 : 0).padStart(2, '0')}` : `${t}`;

function drawTimeLine() {
  const canvas = byId('review-line'), { g, width, height } = begun(canvas);
  const x = t => kLeft + t / (facts.duration_s || 1) * (width - kLeft - kRight);
  g.fillStyle = '#28313a';
  g.fillRect(x(0), 18, x(facts.duration_s) - x(0), 12);
  g.fillStyle = '#33414e';
  g.fillRect(x(stretch[0]), 18, Math.max(1, x(stretch[1]) - x(stretch[0])), 12);
  for (const mark of facts.alerts) {
    g.fillStyle = kRuleColours[mark.rule];
    g.globalAlpha = 0.35;
    g.fillRect(x(mark.t), 18, Math.max(1, x(mark.cleared_t ?? facts.duration_s) - x(mark.t)), 12);
    g.globalAlpha = 1;
    g.beginPath();
    g.moveTo(x(mark.t) - 4, 8); g.lineTo(x(mark.t) + 4, 8); g.lineTo(x(mark.t), 18);
    g.fill();
    g.fillRect(x(mark.t) - 0.5, 16, 1, 14);
  }
  g.fillStyle = '#8d99a6';
  g.textAlign = 'center';
  for (const t of ticks(0, facts.duration_s || 1, Math.max(2, width / 90))) {
    g.fillRect(x(t), 30, 1, 4);
    g.fillText(tickText(t), x(t), 44);
  }
  g.textAlign = 'left';
  g.fillText('s', 4, 44);
  drawCursor(g, x(shownTime()), 4, 32);
}

function drawCursor(g, x, top, bottom) {
  g.fillStyle = '#fff';
  g.fillRect(x - 1, top, 2, bottom - top);
}

// Draws the plots into one canvas, one below the other, with one axis of time.
function drawPlots() {
  const canvas = byId('review-plots'), { g, width, height } = begun(canvas);
  if (!columns) return;
  const right = width - kRight, x = t => kLeft + (t - stretch[0]) / (stretch[1] - stretch[0]) * (right - kLeft);
  let top = 0;
  for (const plot of plotNames()) {
    const series = facts.series.filter(one => one.plot === plot), bottom = top + 16 + kPlotHeight[plot];
    g.save();
    drawFrame(g, plot, series, top, right);
    if (plot === 'link') drawStates(g, series, top + 16, x, right);
    else drawCurves(g, series, top + 16, bottom - 4, x, right);
    g.restore();
    top = bottom + 4;
  }
  g.fillStyle = '#8d99a6';
  g.textAlign = 'center';
  for (const t of ticks(stretch[0], stretch[1], Math.max(2, (right - kLeft) / 70))) {
    g.fillRect(x(t), top - 6, 1, 4);
    g.fillText(tickText(t), Math.min(right - 8, x(t)), top + 9);
  }
  g.textAlign = 'left';
  g.fillText('s', 4, top + 9);
  for (const mark of facts.alerts) {
    if (mark.t < stretch[0] || mark.t > stretch[1]) continue;
    g.fillStyle = kRuleColours[mark.rule] + '70';
    g.fillRect(x(mark.t), 14, 1, top - 20);
  }
  const t = shownTime();
  if (t >= stretch[0] && t <= stretch[1]) drawCursor(g, x(t), 14, top - 4);
}

function plotNames() { return [...new Set(facts.series.map(one => one.plot))]; }
function plotsHeight() { return plotNames().reduce((sum, plot) => sum + 20 + kPlotHeight[plot], 14); }

function drawFrame(g, plot, series, top, right) {
  const units = [...new Set(series.map(one => one.unit))].filter(Boolean).join(' / ');
  g.fillStyle = '#e4e8ec';
  g.fillText(text('review_plot.' + plot) + (units ? `, ${units}` : ''), kLeft, top + 11);
  if (series.length < 2 || plot === 'link') return;
  let at = right;
  g.textAlign = 'right';
  [...series].reverse().forEach((one, back) => {
    g.fillStyle = kPlotColours[(series.length - 1 - back) % kPlotColours.length];
    const name = one.label.replace(/_.*/, '');
    g.fillText(name, at, top + 11);
    at -= g.measureText(name).width + 7;
  });
  g.textAlign = 'left';
}

function drawCurves(g, series, top, bottom, x, right) {
  const data = series.map(one => columns.series[one.name]);
  let least = 0, most = series[0].plot === 'closeness' ? 1 : 0;
  for (const one of data) {
    for (const v of one.least) if (v !== null && v < least) least = v;
    for (const v of one.greatest) if (v !== null && v > most) most = v;
  }
  if (most - least < 1e-6) most = least + 1;
  const y = v => bottom - (v - least) / (most - least) * (bottom - top);
  g.textAlign = 'right';
  for (const v of ticks(least, most, Math.max(2, (bottom - top) / 19))) {
    g.fillStyle = v === 0 ? '#4a5663' : '#262e37';
    g.fillRect(kLeft, y(v), right - kLeft, 1);
    g.fillStyle = '#8d99a6';
    g.fillText(String(v), kLeft - 5, y(v) + 4);
  }
  g.textAlign = 'left';
  g.beginPath();
  g.rect(kLeft, top - 2, right - kLeft, bottom - top + 4);
  g.clip();
  const count = data[0].least.length, span = (columns.to - columns.from) / count;
  series.forEach((one, k) => {
    g.strokeStyle = kPlotColours[k % kPlotColours.length];
    g.lineWidth = 1.2;
    g.beginPath();
    let last = -Infinity;
    for (let i = 0; i < count; ++i) {
      const low = data[k].least[i], high = data[k].greatest[i];
      if (low === null) continue;
      const at = x(columns.from + (i + 0.5) * span);
      if ((i - last) * span > kConnected_s && i - last > 1) g.moveTo(at, y(low));
      else g.lineTo(at, y(low));
      g.lineTo(at, Math.min(y(high), y(low) - 0.4));
      last = i;
    }
    g.stroke();
  });
}

function drawStates(g, series, top, x, right) {
  const row = 18;
  series.forEach((one, k) => {
    const data = columns.series[one.name], count = data.least.length, span = (columns.to - columns.from) / count, y = top + k * row;
    g.fillStyle = '#8d99a6';
    g.textAlign = 'right';
    g.fillText(one.label, kLeft - 5, y + 11);
    const colour = value => one.name === 'contact' ? (value ? '#e5484d' : '#28313a') : kStateColours[value] ?? '#5d6873';
    let held = null, heldAt = -Infinity;
    for (let i = 0; i < count; ++i) {
      let low = data.least[i], high = data.greatest[i];
      if (low === null && held !== null && (i - heldAt) * span < kConnected_s) low = high = held;
      else if (low !== null) { held = high; heldAt = i; }
      if (low === null) continue;
      const left = x(columns.from + i * span), wide = x(columns.from + (i + 1) * span) - left + 0.5;
      if (left + wide < kLeft || left > right) continue;
      g.fillStyle = colour(low);
      g.fillRect(left, y, wide, 14);
      if (high === low) continue;
      g.fillStyle = colour(high);
      g.fillRect(left, y, wide, 7);
    }
  });
  g.textAlign = 'left';
}

function drawAll() {
  if (!facts) return;
  drawTimeLine();
  drawPlots();
  const t = shownTime();
  put('review-time', text('review.time', { at: t, whole: facts.duration_s }));
  put('review-clock', clock(facts.begin_utc_ms + t * 1e3));
  const mark = facts.alerts.findLast(one => one.t <= t);
  const now = mark && (mark.cleared_t === null || mark.cleared_t >= t);
  put('review-alert', !facts.alerts.length ? text('review.no_alerts')
    : mark ? text('review.alert', { number: facts.alerts.indexOf(mark) + 1, count: facts.alerts.length, what: alertWords(mark) })
    : text('review.alerts', { count: facts.alerts.length }));
  byId('review-alert').classList.toggle('threatening', Boolean(now));
  for (const id of ['review-line', 'review-plots']) {
    const slider = byId(id);
    slider.setAttribute('aria-valuenow', t.toFixed(2));
    slider.setAttribute('aria-valuetext', `${t.toFixed(2)} s`);
  }
}

// ---- the elements ----

function button(id, sign, act) {
  const element = make('button', { id, type: 'button', textContent: sign });
  element.addEventListener('click', act);
  return element;
}
function name(id, words) {
  byId(id).title = words;
  byId(id).setAttribute('aria-label', words);
}

// Writes all that does not change with the moment, in the page's language.
function showReviewTexts() {
  document.title = `${text('review.title')} – Phantom`;
  put('review-notice', text('review.notice', { begin: clock(facts.begin_utc_ms) }));
  name('review-rate', text('review.speed'));
  name('review-previous', text('review.previous'));
  name('review-next', text('review.next'));
  name('review-bar', text('review.bar'));
  name('review-line', text('review.time_line'));
  name('review-plots', text('review.over_time'));
  put('review-heading', text('review.over_time'));
  put('review-whole', text('review.whole'));
  if (facts.problems.length) put('review-problems', text('review.problems', { what: facts.problems.join('; ') }));
  for (const [key, what] of kKeys) {
    put(`review-key-${what}`, key === 'space' ? text('review_key.space') : key);
    put(`review-does-${what}`, text('review_key.' + what));
  }
}

function slider(id) {
  const canvas = make('canvas', { id, tabIndex: 0 });
  canvas.setAttribute('role', 'slider');
  canvas.setAttribute('aria-valuemin', 0);
  canvas.setAttribute('aria-valuemax', facts.duration_s.toFixed(2));
  const range = () => id === 'review-line' ? [0, facts.duration_s] : stretch;
  const timeAt = event => {
    const share = (event.offsetX - kLeft) / (canvas.clientWidth - kLeft - kRight), [from, to] = range();
    return clampTime(from + share * (to - from));
  };
  // The alert under the pointer, if it is as near as a hand can point.
  const markAt = event => {
    const [from, to] = range(), near = 5 * (to - from) / canvas.clientWidth, t = timeAt(event);
    return facts.alerts.reduce((best, mark) => Math.abs(mark.t - t) <= near && (!best || Math.abs(mark.t - t) < Math.abs(best.t - t)) ? mark : best, null);
  };
  canvas.addEventListener('pointerdown', event => {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    canvas.focus();
    const mark = markAt(event);
    goTo(mark ? mark.t + kAlertEntered_s : timeAt(event));
  });
  canvas.addEventListener('pointermove', event => {
    if (canvas.hasPointerCapture(event.pointerId)) goTo(timeAt(event));
    const mark = markAt(event), tip = byId('review-tip');
    put(tip, mark ? alertWords(mark) : `${timeAt(event).toFixed(2)} s`);
    tip.hidden = false;
    tip.style.left = Math.max(4, Math.min(innerWidth - tip.offsetWidth - 4, event.clientX - tip.offsetWidth / 2)) + 'px';
    tip.style.top = Math.max(4, event.clientY - tip.offsetHeight - 14) + 'px';
  });
  for (const leave of ['pointerleave', 'pointercancel', 'blur']) canvas.addEventListener(leave, () => { byId('review-tip').hidden = true; });
  canvas.addEventListener('wheel', event => {
    event.preventDefault();
    zoomStretch(event.deltaY < 0 ? 0.8 : 1 / 0.8, timeAt(event));
  }, { passive: false });
  canvas.addEventListener('keydown', event => {
    const far = event.shiftKey ? 10 : 1, t = shownTime();
    if (event.key === 'ArrowLeft' || event.key === 'ArrowDown') goTo(t - far);
    else if (event.key === 'ArrowRight' || event.key === 'ArrowUp') goTo(t + far);
    else if (event.key === 'Home') goTo(0);
    else if (event.key === 'End') goTo(facts.duration_s);
    else if (event.key === '+' || event.key === '=') zoomStretch(0.5);
    else if (event.key === '-') zoomStretch(2);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  return canvas;
}

function build() {
  document.body.classList.add('review');
  document.querySelector('.top').append(make('p', { id: 'review-notice', className: 'review-notice' }));
  const rate = make('select', { id: 'review-rate' }, ...kRates.map(value => new Option(`${value} ×`, value)));
  rate.addEventListener('change', () => { setRate(+rate.value); rate.blur(); });
  const bar = make('section', { id: 'review-bar', className: 'review-bar' },
    make('div', { className: 'review-tools' },
      button('review-previous', '|◀', () => stepAlert(-1)), button('review-play', '▶', togglePlay), button('review-next', '▶|', () => stepAlert(1)),
      rate, make('b', { id: 'review-time' }), make('span', { id: 'review-clock' }), make('span', { id: 'review-alert', role: 'status' })),
    slider('review-line'));
  document.body.append(bar, make('div', { id: 'review-tip', className: 'review-tip', hidden: true }));
  const plots = make('section', { className: 'panel review-panel' },
    make('h2', {}, make('span', { id: 'review-heading' }), button('review-whole', '', () => moveStretch(0, facts.duration_s))), slider('review-plots'));
  if (facts.problems.length) plots.append(make('p', { id: 'review-problems' }));
  document.querySelector('.column.last').prepend(plots);
  byId('review-plots').style.height = plotsHeight() + 'px';
  document.querySelector('.keys dl').prepend(...kKeys.map(([, what]) => make('div', {},
    make('dt', {}, make('kbd', { id: `review-key-${what}` })), make('dd', { id: `review-does-${what}` }))));
  showReviewTexts();
  addEventListener('language', () => { showReviewTexts(); drawAll(); });
  stretch = [0, facts.duration_s];
  new ResizeObserver(() => { askColumns(); drawAll(); }).observe(byId('review-plots'));
}

async function beginReview() {
  if (beginReview.busy) return;
  beginReview.busy = true;
  try {
    const response = await fetch('review', { signal: within(3000), cache: 'no-store' });
    if (response.ok) {
      facts = await response.json();
      if (!byId('review-bar')) build();
    }
  } catch (problem) { /* the next state asks again */ }
  beginReview.busy = false;
}

document.addEventListener('state', event => {
  const { review, viewer } = event.detail;
  if (!review) return;
  position = review;  // known before the keys do anything
  if (!facts) return beginReview();
  if (wantedRate !== null && Math.abs(review.rate - wantedRate) < 1e-9) wantedRate = null;
  const past = wantedTime === null ? -1 : position.t - wantedTime;  // it may have gone on by itself since
  if (past > -2e-3 && past < (playing() ? 2 * position.rate : 2e-3)) wantedTime = null;
  const allowed = viewer.allow_commands && may('operate');
  for (const control of document.querySelectorAll('#review-bar button, #review-bar select')) control.disabled = !allowed;
  put('review-play', playing() ? '❚❚' : '▶');
  name('review-play', text(playing() ? 'review.pause' : 'review.play'));
  if (document.activeElement !== byId('review-rate')) byId('review-rate').value = position.rate;
  if (playing() && position.t > stretch[1]) moveStretch(position.t);
  drawAll();
});

addEventListener('keydown', event => {
  const combined = (event.ctrlKey || event.altKey || event.metaKey) && !event.getModifierState('AltGraph');  // which brackets may need
  if (!facts || combined || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
  if (event.key === ' ' && /^(BUTTON|SUMMARY|A)$/.test(event.target.tagName)) return;  // it presses what has the focus
  if (event.key === ' ') { if (!event.repeat) togglePlay(); }
  else if (event.key === ',') goTo(shownTime() - 0.1);
  else if (event.key === '.') goTo(shownTime() + 0.1);
  else if (event.key === '[' || event.key === 'PageUp') stepAlert(-1);
  else if (event.key === ']' || event.key === 'PageDown') stepAlert(1);
  else if (event.key === '<') stepRate(-1);
  else if (event.key === '>') stepRate(1);
  else return;
  event.preventDefault();
});

// The first pictures of alerts are made once nothing else is to be drawn: a picture that is not there yet is asked for again.
document.addEventListener('error', event => {
  const image = event.target;
  if (!facts || image.tagName !== 'IMG' || !/\/hits\/\d+\.jpg/.test(image.src)) return;
  const tries = +(image.dataset.tries || 0);
  if (tries > 20) return;
  image.dataset.tries = tries + 1;
  setTimeout(() => {
    if (!image.isConnected || !/\/hits\/\d+\.jpg/.test(image.src)) return;
    image.loading = 'eager';
    image.addEventListener('load', () => { if (image.parentElement.tagName === 'A') image.parentElement.hidden = false; }, { once: true });
    image.src = image.src;
  }, 500);
}, true);
})();
