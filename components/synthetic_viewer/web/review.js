'use strict';
// A recorded session on the page: the bar with the time line, and the plots that go with the pictures (review_plots.js). Does nothing
// on a live page. The newest position is in the state's `review`; what the recording has comes once, by GET /review. Fields: page_review.cpp.

(() => {
  const kKeys = [
    ['space', 'play'],
    [', .', 'step'],
    ['[ ]', 'alert'],
    ['< >', 'rate'],
    ['← →', 'arrows'],
    ['+ −', 'zoom'],
    ['|← →|', 'ends'],
  ];
  const kRates = [0.1, 0.2, 0.5, 1, 2, 5, 10];
  const kAlertEntered_s = 0.02; // after an alert came, the percept that it rests on is there, too
  const kMin_s = 0.2;

  let facts = null; // newest answer of GET /review; null: not asked yet
  let position = null; // newest position of the viewer
  let wantedTime = null; // where this page asked to go, until the viewer is there
  let stretch = [0, 1]; // what the plots show, in s
  let columns = null; // newest answer of GET /review/series

  const clock = ms => new Date(ms).toISOString().replace('T', ' ').slice(0, 19) + ' UTC';
  const shownTime = () => wantedTime ?? (position ? position.t : 0);
  const clampTime = t => Math.max(0, Math.min(facts.duration_s, t));
  function alertWords(mark) {
    const over = mark.cleared_t === null ? '' : text('review.over', {time: duration(mark.cleared_t - mark.t)});
    return text('review.mark', {
      alert: mark.alert,
      at: mark.t,
      link: mark.interest_point || mark.link,
      object: mark.object,
      rule: text('rule.' + mark.rule),
      speed: mark.speed_m_s,
      over,
    });
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

  // Returns a function that does `act`, one after the other: of calls that come while one is on its way, only the newest counts.
  function newestOf(act) {
    let busy = false,
      waiting = null;
    return async value => {
      waiting = {value};
      if (busy) return;
      busy = true;
      for (let next; (next = waiting) !== null;) {
        waiting = null;
        await act(next.value);
      }
      busy = false;
    };
  }

  const sendTime = newestOf(async t => {
    await send({t: Math.round(t * 1e6) / 1e6});
    setTimeout(() => {
      if (wantedTime === t) wantedTime = null;
    }, 1000); // if no state says that the viewer is there
  });
  function goTo(t) {
    const to = clampTime(t);
    if (wantedTime === to) return;
    wantedTime = to;
    showMoment();
    sendTime(to);
  }

  const playing = () => position !== null && position.playing;
  function togglePlay() {
    send({play: !playing()});
  }
  let wantedRate = null; // what this page asked for, until the viewer has it
  function setRate(rate) {
    wantedRate = rate;
    send({rate});
  }
  function stepRate(by) {
    const at = kRates.findIndex(rate => rate >= (wantedRate ?? position?.rate ?? 1) - 1e-9);
    setRate(kRates[Math.max(0, Math.min(kRates.length - 1, at + by))]);
  }
  function markAfter(by) {
    const t = shownTime();
    return by > 0
      ? facts.alerts.find(mark => mark.t + kAlertEntered_s > t + 5e-4)
      : facts.alerts.findLast(mark => mark.t + kAlertEntered_s < t - 5e-4);
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

  const askColumns = newestOf(async () => {
    const width = Math.max(50, Math.round(byId('review-plots').clientWidth - reviewPlots.left - reviewPlots.right));
    const names = facts.series.map(one => one.name).join(','),
      [from, to] = stretch;
    try {
      const response = await fetch(`review/series?names=${names}&from=${from}&to=${to}&columns=${width}`, {
        signal: within(3000),
        cache: 'no-store',
      });
      if (!response.ok) return;
      columns = await response.json();
      redraw();
    } catch (problem) {
      /* showBanner() reports it */
    }
  });

  // ---- the stretch that the plots show ----

  function moveStretch(from, length = stretch[1] - stretch[0]) {
    const whole = facts.duration_s;
    const long = Math.max(Math.min(kMin_s, whole), Math.min(whole, length));
    const begin = Math.max(0, Math.min(whole - long, from));
    stretch = [begin, begin + long];
    askColumns();
    redraw();
  }
  function zoomStretch(factor, about = shownTime()) {
    moveStretch(about - (about - stretch[0]) * factor, (stretch[1] - stretch[0]) * factor);
  }

  // ---- what is shown ----

  // Draws time line and plots anew in the next frame. What only follows the moment is not drawn: showMoment() moves it.
  let frame = 0;
  function redraw() {
    showMoment();
    frame ||= requestAnimationFrame(() => {
      frame = 0;
      reviewPlots.drawTimeLine(byId('review-line'), facts, stretch);
      if (columns) reviewPlots.drawPlots(byId('review-plots'), facts, stretch, columns);
    });
  }

  function showMoment() {
    const t = shownTime();
    put('review-time', text('review.time', {at: t, whole: facts.duration_s}));
    put('review-clock', clock(facts.begin_utc_ms + t * 1e3));
    const mark = facts.alerts.findLast(one => one.t <= t);
    const now = mark && (mark.cleared_t === null || mark.cleared_t >= t);
    put(
      'review-alert',
      !facts.alerts.length
        ? text('review.no_alerts')
        : mark
          ? text('review.alert', {
              number: facts.alerts.indexOf(mark) + 1,
              count: facts.alerts.length,
              what: alertWords(mark),
            })
          : text('review.alerts', {count: facts.alerts.length}),
    );
    byId('review-alert').classList.toggle('threatening', Boolean(now));
    for (const [id, [from, to]] of [
      ['review-line', [0, facts.duration_s]],
      ['review-plots', stretch],
    ]) {
      const slider = byId(id),
        cursor = byId(id + '-cursor');
      if (slider.ariaValueNow !== t.toFixed(2))
        Object.assign(slider, {ariaValueNow: t.toFixed(2), ariaValueText: `${t.toFixed(2)} s`});
      cursor.style.transform = `translateX(${(100 * (t - from)) / (to - from || 1)}%)`;
      cursor.hidden = t < from || t > to;
    }
  }

  // ---- the elements ----

  function button(id, sign, act) {
    const element = make('button', {id, type: 'button', textContent: sign});
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
    put('review-notice', text('review.notice', {begin: clock(facts.begin_utc_ms)}));
    name('review-rate', text('review.speed'));
    name('review-previous', text('review.previous'));
    name('review-next', text('review.next'));
    name('review-bar', text('review.bar'));
    name('review-line', text('review.time_line'));
    name('review-plots', text('review.over_time'));
    put('review-heading', text('review.over_time'));
    put('review-whole', text('review.whole'));
    if (facts.problems.length) put('review-problems', text('review.problems', {what: facts.problems.join('; ')}));
    for (const [key, what] of kKeys) {
      put(`review-key-${what}`, key === 'space' ? text('review_key.space') : key);
      put(`review-does-${what}`, text('review_key.' + what));
    }
  }

  function slider(id) {
    const canvas = make('canvas', {id, tabIndex: 0});
    canvas.setAttribute('role', 'slider');
    canvas.setAttribute('aria-valuemin', 0);
    canvas.setAttribute('aria-valuemax', facts.duration_s.toFixed(2));
    const range = () => (id === 'review-line' ? [0, facts.duration_s] : stretch);
    const timeAt = event => {
      const {left, right} = reviewPlots,
        share = (event.offsetX - left) / (canvas.clientWidth - left - right),
        [from, to] = range();
      return clampTime(from + share * (to - from));
    };
    // The alert under the pointer, if it is as near as a hand can point.
    const markAt = event => {
      const [from, to] = range(),
        near = (5 * (to - from)) / canvas.clientWidth,
        t = timeAt(event);
      return facts.alerts.reduce(
        (best, mark) =>
          Math.abs(mark.t - t) <= near && (!best || Math.abs(mark.t - t) < Math.abs(best.t - t)) ? mark : best,
        null,
      );
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
      const mark = markAt(event),
        tip = byId('review-tip');
      put(tip, mark ? alertWords(mark) : `${timeAt(event).toFixed(2)} s`);
      tip.hidden = false;
      tip.style.left =
        Math.max(4, Math.min(innerWidth - tip.offsetWidth - 4, event.clientX - tip.offsetWidth / 2)) + 'px';
      tip.style.top = Math.max(4, event.clientY - tip.offsetHeight - 14) + 'px';
    });
    for (const leave of ['pointerleave', 'pointercancel', 'blur'])
      canvas.addEventListener(leave, () => {
        byId('review-tip').hidden = true;
      });
    canvas.addEventListener(
      'wheel',
      event => {
        event.preventDefault();
        zoomStretch(event.deltaY < 0 ? 0.8 : 1 / 0.8, timeAt(event));
      },
      {passive: false},
    );
    canvas.addEventListener('keydown', event => {
      const far = event.shiftKey ? 10 : 1,
        t = shownTime();
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
    return make(
      'div',
      {className: 'review-strip'},
      canvas,
      make('i', {id: id + '-cursor', className: 'review-cursor'}),
    );
  }

  function build() {
    document.body.classList.add('review');
    document.querySelector('.top').append(make('p', {id: 'review-notice', className: 'review-notice'}));
    const rate = make('button', {id: 'review-rate', type: 'button', className: 'choice'});
    rate.addEventListener('change', () => {
      setRate(+rate.value);
      rate.blur();
    });
    const bar = make(
      'section',
      {id: 'review-bar', className: 'review-bar'},
      make(
        'div',
        {className: 'review-tools'},
        button('review-previous', '|◀', () => stepAlert(-1)),
        button('review-play', '▶', togglePlay),
        button('review-next', '▶|', () => stepAlert(1)),
        rate,
        make('b', {id: 'review-time'}),
        make('span', {id: 'review-clock'}),
        make('span', {id: 'review-alert', role: 'status'}),
      ),
      slider('review-line'),
    );
    document.body.append(bar, make('div', {id: 'review-tip', className: 'review-tip', hidden: true}));
    makeChoice(rate);
    offerChoice(
      rate,
      kRates.map(value => [String(value), `${value} ×`]),
    );
    const plots = make(
      'section',
      {className: 'drawer review-panel'},
      make(
        'h2',
        {},
        make('span', {id: 'review-heading'}),
        button('review-whole', '', () => moveStretch(0, facts.duration_s)),
      ),
      slider('review-plots'),
    );
    if (facts.problems.length) plots.append(make('p', {id: 'review-problems'}));
    document.querySelector('.work').append(plots);
    byId('review-plots').style.height = reviewPlots.height(facts) + 'px';
    document
      .querySelector('.keys dl')
      .prepend(
        ...kKeys.map(([, what]) =>
          make(
            'div',
            {},
            make('dt', {}, make('kbd', {id: `review-key-${what}`})),
            make('dd', {id: `review-does-${what}`}),
          ),
        ),
      );
    showReviewTexts();
    addEventListener('language', () => {
      showReviewTexts();
      redraw();
    });
    stretch = [0, facts.duration_s];
    new ResizeObserver(() => {
      askColumns();
      redraw();
    }).observe(byId('review-plots'));
  }

  async function beginReview() {
    if (beginReview.busy) return;
    beginReview.busy = true;
    try {
      const response = await fetch('review', {signal: within(3000), cache: 'no-store'});
      if (response.ok) {
        facts = await response.json();
        if (!byId('review-bar')) build();
      }
    } catch (problem) {
      /* the next state asks again */
    }
    beginReview.busy = false;
  }

  document.addEventListener('state', event => {
    const {review, viewer} = event.detail;
    if (!review) return;
    position = review; // known before the keys do anything
    if (!facts) return beginReview();
    if (wantedRate !== null && Math.abs(review.rate - wantedRate) < 1e-9) wantedRate = null;
    const past = wantedTime === null ? -1 : position.t - wantedTime; // it may have gone on by itself since
    if (past > -2e-3 && past < (playing() ? 2 * position.rate : 2e-3)) wantedTime = null;
    const allowed = viewer.allow_commands && may('operate');
    for (const control of document.querySelectorAll('#review-bar button')) control.disabled = !allowed;
    put('review-play', playing() ? '❚❚' : '▶');
    name('review-play', text(playing() ? 'review.pause' : 'review.play'));
    setChoice(byId('review-rate'), String(position.rate));
    if (playing() && position.t > stretch[1]) moveStretch(position.t);
    showMoment();
  });

  addEventListener('keydown', event => {
    const combined = (event.ctrlKey || event.altKey || event.metaKey) && !event.getModifierState('AltGraph'); // which brackets may need
    if (!facts || combined || /^(INPUT|TEXTAREA)$/.test(event.target.tagName)) return;
    if (event.key === ' ' && /^(BUTTON|SUMMARY|A)$/.test(event.target.tagName)) return; // it presses what has the focus
    if (event.key === ' ') {
      if (!event.repeat) togglePlay();
    } else if (event.key === ',') goTo(shownTime() - 0.1);
    else if (event.key === '.') goTo(shownTime() + 0.1);
    else if (event.key === '[' || event.key === 'PageUp') stepAlert(-1);
    else if (event.key === ']' || event.key === 'PageDown') stepAlert(1);
    else if (event.key === '<') stepRate(-1);
    else if (event.key === '>') stepRate(1);
    else return;
    event.preventDefault();
  });
})();
