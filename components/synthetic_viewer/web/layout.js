'use strict';
// Where things stand: which view is large, which have a window of their own, and where, and which drawer is open. The
// choice is kept by the browser. A window of its own is this page with ?view=NAME: it shows that view, the stop and
// what must not be missed. Uses views.js.

const kLayoutKept = 'phantom.layout',
  kPlaceKept = 'phantom.window.';
const kViewNames = ['main', 'hit', 'tool', 'camera'],
  kSides = 3;
const kAlive_ms = 1000,
  kGone_ms = 2500; // a window of its own says so often that it is there; so long without, and its view comes back
const kAlone = new URLSearchParams(location.search).get('view');
const alone = kViewNames.includes(kAlone) ? kAlone : null;
const figureOf = view => byId(view + '-figure');

const layout = {large: 'main', enlarged: false};
try {
  const kept = JSON.parse(localStorage.getItem(kLayoutKept)) ?? {};
  if (kViewNames.includes(kept.large)) layout.large = kept.large;
  layout.enlarged = kept.enlarged === true;
} catch (problem) {
  /* nothing is kept, or nothing may be */
}

function keepLayout() {
  try {
    localStorage.setItem(kLayoutKept, JSON.stringify(layout));
  } catch (problem) {
    /* chosen for this visit */
  }
}

const elsewhere = new Map(); // view → when its own window was last heard of; ms, as performance.now()
const windows = typeof BroadcastChannel === 'function' ? new BroadcastChannel('phantom-views') : null;
const isElsewhere = view => performance.now() - (elsewhere.get(view) ?? -Infinity) < kGone_ms;
const isOffered = view => !figureOf(view).hidden && !isElsewhere(view);

// Gives each view its place: `large`, `side1` … or none. A view that is not there, or in a window of its own, leaves
// its place to the next.
function showLayout() {
  const offered = kViewNames.filter(view => (alone ? view === alone : isOffered(view)));
  const large = offered.includes(layout.large) ? layout.large : offered[0];
  const sides = offered.filter(view => view !== large);
  for (const view of kViewNames) {
    const figure = figureOf(view),
      place =
        view === large ? 'large' : sides.includes(view) ? `side${Math.min(kSides, sides.indexOf(view) + 1)}` : 'none';
    if (figure.dataset.place !== place) figure.dataset.place = place;
  }
  const desk = byId('desk');
  desk.style.setProperty('--sides', Math.max(1, sides.length));
  desk.classList.toggle('enlarged', layout.enlarged);
  desk.classList.toggle('no-sides', sides.length === 0);
  for (const tools of document.querySelectorAll('[data-places]')) {
    const view = tools.dataset.places,
      isLarge = view === large;
    for (const [name, shown, key] of [
      ['swap', !isLarge, 'layout.swap'],
      ['enlarge', isLarge && !alone, layout.enlarged ? 'layout.shrink' : 'layout.enlarge'],
      ['detach', windows !== null && !alone, 'layout.detach'],
    ]) {
      const button = tools.querySelector('.' + name);
      button.hidden = !shown;
      button.title = text(key);
      button.setAttribute('aria-label', `${text(key)}: ${text('view_name.' + view)}`);
      if (name === 'enlarge') button.setAttribute('aria-pressed', layout.enlarged);
    }
  }
}

function setLarge(view) {
  layout.large = view;
  layout.enlarged = false;
  keepLayout();
  showLayout();
}
function toggleEnlarged() {
  layout.enlarged = !layout.enlarged;
  keepLayout();
  showLayout();
}
// Where a view's own window stood when it was closed last; null: it had none yet, or nothing is kept.
function keptPlace(view) {
  try {
    const place = JSON.parse(localStorage.getItem(kPlaceKept + view));
    return ['left', 'top', 'width', 'height'].every(name => Number.isInteger(place?.[name])) ? place : null;
  } catch (problem) {
    return null;
  }
}
// Puts a window onto the other screen, whole, where this host has one and the browser may tell of it.
async function moveToOtherScreen(opened) {
  if (!globalThis.screen?.isExtended || !globalThis.getScreenDetails) return;
  try {
    const {screens, currentScreen} = await getScreenDetails();
    const other = screens.find(one => one !== currentScreen);
    if (!other) return;
    opened.moveTo(other.availLeft, other.availTop);
    opened.resizeTo(other.availWidth, other.availHeight);
  } catch (problem) {
    /* not allowed: it stays where the browser put it */
  }
}
// Gives a view a window of its own: where it stood last, else on the other screen. Without one, as browsers may refuse
// it, the view stays.
function detach(view) {
  const place = keptPlace(view),
    {width, height} = place ?? {width: 1280, height: 760};
  const at = place ? `,left=${place.left},top=${place.top}` : '';
  const opened =
    windows && window.open(`?view=${view}`, `phantom-${view}`, `popup,width=${width},height=${height}${at}`);
  if (!opened) return say(text('layout.refused'), true);
  if (!place) moveToOtherScreen(opened);
  elsewhere.set(view, performance.now() + 10 * kAlive_ms); // until it speaks for itself
  showLayout();
}
// The view that keys mean: that in focus, else the hit zone's.
const focusedView = () => document.activeElement?.closest?.('figure')?.dataset.figure ?? 'hit';

for (const tools of document.querySelectorAll('[data-places]')) {
  const view = tools.dataset.places;
  for (const [name, sign, act] of [
    ['swap', '⇤', () => setLarge(view)],
    ['enlarge', '⤢', toggleEnlarged],
    ['detach', '❐', () => detach(view)],
  ]) {
    const button = viewButton(name, sign);
    button.addEventListener('click', act);
    tools.append(button);
  }
}
windows?.addEventListener('message', ({data}) => {
  if (!kViewNames.includes(data?.view) || alone) return;
  if (data.gone) elsewhere.delete(data.view);
  else elsewhere.set(data.view, performance.now());
  showLayout();
});
if (alone) {
  document.body.classList.add('alone');
  const alive = gone => windows?.postMessage({view: alone, gone});
  alive(false);
  setInterval(() => alive(false), kAlive_ms);
  addEventListener('pagehide', () => {
    alive(true);
    const place = {left: window.screenX, top: window.screenY, width: window.innerWidth, height: window.innerHeight};
    try {
      localStorage.setItem(kPlaceKept + alone, JSON.stringify(place));
    } catch (problem) {
      /* it opens as at first */
    }
  });
}

// ---- drawers ----

const kDrawers = {settings: 'settings-open', system: 'system-open', keys: 'keys-open', history: 'alarm-history'}; // drawer → its button
let opener = null; // what opened the drawer that is open: the focus goes back there

function openDrawer(name, from = null) {
  const closing = !byId(name).hidden;
  for (const [drawer, button] of Object.entries(kDrawers)) {
    byId(drawer).hidden = closing || drawer !== name;
    byId(button).setAttribute('aria-expanded', !closing && drawer === name);
  }
  if (!closing && name === 'history' && state) showHits(listedHits(state), state.total_hits);
  if (closing) {
    (opener ?? byId(kDrawers[name])).focus();
    opener = null;
  } else {
    if (!from?.closest('.drawer')) opener = from;
    byId(name).querySelector('.close').focus();
  }
}
for (const [drawer, button] of Object.entries(kDrawers)) {
  if (drawer !== 'history') byId(button).addEventListener('click', () => openDrawer(drawer, byId(button)));
  byId(drawer)
    .querySelector('.close')
    .addEventListener('click', () => openDrawer(drawer));
}
addEventListener('language', showLayout);
setInterval(showLayout, 500);
showLayout();
