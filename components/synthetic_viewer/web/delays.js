'use strict';
// Why the hand is limited, and where the delay arises: the stages from the encoders to this page, each with its age and
// its budget.

const kPeak_ms = 2000,
  kLinger_ms = 1000; // so long a stage's greatest age is shown; so long a limit stays after it has ended
const kPageBudget_s = 0.25;
const kPageStage = 'page';

// Holds the greatest of the values of the last moments.
class Peak {
  constructor() {
    this.values = [];
  }
  take(value, now_ms) {
    this.values = this.values.filter(one => now_ms - one.at_ms < kPeak_ms && one.value > value);
    this.values.push({value, at_ms: now_ms});
    return this.values[0].value;
  }
}
const kPeaks = new Map();

// Returns the stages as they are shown: { name, age_s, budget_s, over }. The last one is the way from the viewer to
// this page.
function delayStages(delay, page_s, now_ms) {
  const stages = Object.entries(delay).map(([name, {age_s, budget_s}]) => ({name, age_s, budget_s}));
  const kOrder = ['encoder', 'sensing', 'master', 'viewer', kPageStage];
  stages.push({name: kPageStage, age_s: page_s, budget_s: kPageBudget_s});
  return stages
    .sort((a, b) => kOrder.indexOf(a.name) - kOrder.indexOf(b.name))
    .map(stage => {
      if (!kPeaks.has(stage.name)) kPeaks.set(stage.name, new Peak());
      const age_s = stage.age_s === null ? null : kPeaks.get(stage.name).take(stage.age_s, now_ms);
      return {...stage, age_s, over: age_s !== null && age_s > stage.budget_s};
    });
}

function showDelays(state) {
  const now_ms = performance.now();
  const page_s = stream.still ? (now_ms - stream.heard) / 1000 : stream.clock.onTheWay_s;
  const stages = delayStages(state.delay ?? {}, Number.isFinite(page_s) ? page_s : null, now_ms);
  const over = stages.filter(stage => stage.over),
    known = stages.filter(stage => stage.age_s !== null);
  const total_s = known.reduce((sum, stage) => sum + stage.age_s, 0);
  put('delay', known.length ? duration(total_s) : '–');
  byId('delay').className = over.length ? 'over' : '';
  put('delay-over', over.length ? '▲' : '');
  byId('delay').title = byId('delay-over').title = over.length
    ? over.map(stage => text('delay.over_at', {stage: text('delay.' + stage.name)})).join('\n')
    : text('delay.title');
  const table = byId('delay-stages');
  if (table.childElementCount !== stages.length) {
    table.replaceChildren(
      ...stages.map(() => {
        const row = document.createElement('tr');
        row.innerHTML = '<td></td><td class="number"></td><td class="number"></td><td></td>';
        return row;
      }),
    );
  }
  stages.forEach((stage, i) => {
    const row = table.children[i],
      cells = row.children;
    row.className = stage.over ? 'over' : '';
    put(cells[0], text('delay.' + stage.name));
    row.title = text('delay_tip.' + stage.name);
    put(cells[1], duration(stage.age_s));
    put(cells[2], duration(stage.budget_s));
    put(cells[3], stage.over ? text('delay.over') : '');
  });
}

// What limits the hand now, in one line: the most effective limit, and how many there are beside it, which a click
// lists. A limit stays for a moment, so that one that comes and goes can be read.
const why = {words: null, since_ms: -Infinity};
function showWhy(limits) {
  const now_ms = performance.now();
  if (limits.length) Object.assign(why, {words: limits, since_ms: now_ms});
  else if (now_ms - why.since_ms >= kLinger_ms) why.words = null;
  const shown = why.words ?? [];
  put('why', shown.length ? said(shown[0]) : text('limit.none'));
  byId('why-line').classList.toggle('limited', shown.length > 0);
  byId('why-more').hidden = shown.length < 2;
  if (shown.length < 2) openWhy(false);
  put('why-more', text('limit.more', {count: shown.length - 1}));
  const list = byId('why-all');
  if (list.children.length !== shown.length) list.replaceChildren(...shown.map(() => document.createElement('li')));
  shown.forEach((words, i) => put(list.children[i], said(words)));
}
function openWhy(open) {
  byId('why-all').hidden = !open;
  byId('why-more').setAttribute('aria-expanded', open);
}
byId('why-more').addEventListener('click', () => openWhy(byId('why-all').hidden));
