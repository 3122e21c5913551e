'use strict';
// A tour of the page in five steps, for whoever sees it for the first time. It stands in a bar of its own and covers
// nothing; what a step is about has a frame. It takes no keys: Esc stops the arm during it, too. Offered once; the
// browser keeps that it was.

const kTourKept = 'phantom.tour',
  kTourDone = 'seen';
const kTourSteps = [
  ['views', 'main-figure'],
  ['felt', 'felt'],
  ['alarms', 'alarm-panel'],
  ['why', 'why-line'],
  ['stop', 'stop'],
];
const tour = {step: null}; // null: not begun

function isTourOffered() {
  try {
    return localStorage.getItem(kTourKept) === null;
  } catch (problem) {
    return false;
  } // it would be offered each time
}
function keepTourSeen() {
  try {
    localStorage.setItem(kTourKept, kTourDone);
  } catch (problem) {
    /* offered again at the next visit */
  }
}

function showTour() {
  const begun = tour.step !== null,
    offered = !begun && isTourOffered() && !alone && state !== null && !state.review;
  byId('tour').hidden = !begun && !offered;
  kTourSteps.forEach(([, id], i) => byId(id).classList.toggle('toured', i === tour.step));
  if (byId('tour').hidden) return;
  put('tour-count', begun ? text('tour.count', {step: tour.step + 1, steps: kTourSteps.length}) : '');
  put('tour-words', text(begun ? 'tour.' + kTourSteps[tour.step][0] : 'tour.offer'));
  byId('tour-back').hidden = !begun || tour.step === 0;
  put('tour-next', text(!begun ? 'tour.begin' : tour.step === kTourSteps.length - 1 ? 'tour.done' : 'tour.next'));
  put('tour-end', text(begun ? 'tour.end' : 'tour.later'));
  byId('tour-end').hidden = begun && tour.step === kTourSteps.length - 1;
}

// Goes to a step; beyond the last, or before the first, the tour is over.
function goTour(step) {
  const over = step < 0 || step >= kTourSteps.length,
    had = byId('tour').contains(document.activeElement);
  tour.step = over ? null : step;
  keepTourSeen();
  showTour();
  if (!over) byId('tour-next').focus();
  else if (had) byId('keys-open').focus();
}
function beginTour() {
  if (!byId('keys').hidden) openDrawer('keys');
  if (layout.enlarged) toggleEnlarged(); // what it shows has to be there
  goTour(0);
}

byId('tour-next').addEventListener('click', () => (tour.step === null ? beginTour() : goTour(tour.step + 1)));
byId('tour-back').addEventListener('click', () => goTour(tour.step - 1));
byId('tour-end').addEventListener('click', () => goTour(kTourSteps.length));
byId('tour-begin').addEventListener('click', beginTour);
document.addEventListener('state', showTour);
addEventListener('language', showTour);
