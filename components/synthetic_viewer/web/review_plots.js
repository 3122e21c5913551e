'use strict';
// What a recording's page draws: its time line and its plots, in one canvas each. They are drawn anew only when they are others; the
// line that tells the moment stands over them and is moved (review.js). `facts`: answer of GET /review; `stretch`: what the plots show,
// from and to in s; `columns`: newest answer of GET /review/series. Fields: page_review.cpp.

const reviewPlots = (() => {
  const kPlotColours = ['#56b4e9', '#e69f00', '#2fbf8f', '#f0e442', '#d58bb5', '#ee7733', '#8aa0ff', '#c3ccd5'];
  const kStateColours = ['#5d6873', '#4fa3e3', '#9b8cf0', '#46a758', '#f0a028', '#e5484d']; // by number of link state
  const kRuleColours = {very_close: '#e5484d', moderate_moving: '#f0a028', far_nearing: '#f0e442', none: '#8d99a6'};
  const kPlotHeight = {closeness: 50, speed: 50, percept: 82, feedback: 82, link: 56};
  const kLeft = 46,
    kRight = 8; // as .review-cursor has them
  const kConnected_s = 0.3;

  // Returns a canvas's context in CSS pixels, cleared. The processor draws it: it is little, and where software stands in for a graphics
  // card, a canvas that this draws holds up the whole page.
  function begun(canvas) {
    const scale = devicePixelRatio || 1,
      width = canvas.clientWidth,
      height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * scale)) canvas.width = Math.round(width * scale);
    if (canvas.height !== Math.round(height * scale)) canvas.height = Math.round(height * scale);
    const g = canvas.getContext('2d', {willReadFrequently: true});
    g.setTransform(scale, 0, 0, scale, 0, 0);
    g.clearRect(0, 0, width, height);
    g.font = '11px system-ui, "DejaVu Sans", sans-serif';
    return {g, width, height};
  }

  // Returns round numbers within [least, most], about `count` of them.
  function ticks(least, most, count) {
    const rough = (most - least) / count,
      unit = 10 ** Math.floor(Math.log10(rough));
    const step = unit * [1, 2, 5, 10].find(f => unit * f >= rough * 0.999);
    const list = [];
    for (let k = Math.ceil(least / step - 1e-9); k * step <= most + 1e-9 * step; ++k)
      list.push(+(k * step).toPrecision(10));
    return list;
  }
  const tickText = t =>
    t >= 60 ? `${Math.floor(t / 60)}:${(t % 60).toFixed(t % 1 ? 1 : 0).padStart(2, '0')}` : `${t}`;

  function drawTimeLine(canvas, facts, stretch) {
    const {g, width} = begun(canvas);
    const x = t => kLeft + (t / (facts.duration_s || 1)) * (width - kLeft - kRight);
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
      g.moveTo(x(mark.t) - 4, 8);
      g.lineTo(x(mark.t) + 4, 8);
      g.lineTo(x(mark.t), 18);
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
  }

  // Draws the plots, one below the other, with one axis of time.
  function drawPlots(canvas, facts, stretch, columns) {
    const {g, width} = begun(canvas);
    const right = width - kRight,
      x = t => kLeft + ((t - stretch[0]) / (stretch[1] - stretch[0])) * (right - kLeft);
    let top = 0;
    for (const plot of plotNames(facts)) {
      const series = facts.series.filter(one => one.plot === plot),
        bottom = top + 16 + kPlotHeight[plot];
      g.save();
      drawFrame(g, plot, series, top, right);
      if (plot === 'link') drawStates(g, series, columns, top + 16, x, right);
      else drawCurves(g, series, columns, top + 16, bottom - 4, x, right);
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
  }

  const plotNames = facts => [...new Set(facts.series.map(one => one.plot))];
  const height = facts => plotNames(facts).reduce((sum, plot) => sum + 20 + kPlotHeight[plot], 14);

  function drawFrame(g, plot, series, top, right) {
    const units = [...new Set(series.map(one => one.unit))].filter(Boolean).join(' / ');
    g.fillStyle = '#e4e8ec';
    const title = text('review_plot.' + plot) + (units ? `, ${units}` : '');
    g.fillText(title, kLeft, top + 11);
    if (series.length < 2 || plot === 'link') return;
    const names = series.map(one => one.label.replace(/_.*/, ''));
    const wide = names.reduce((sum, name) => sum + g.measureText(name).width + 7, 0);
    // Beside the title, or in the plot's own corner where there is no room.
    const row = kLeft + g.measureText(title).width + 7 > right - wide ? 24 : 11;
    let at = right;
    g.textAlign = 'right';
    for (let i = names.length - 1; i >= 0; --i) {
      g.fillStyle = kPlotColours[i % kPlotColours.length];
      g.fillText(names[i], at, top + row);
      at -= g.measureText(names[i]).width + 7;
    }
    g.textAlign = 'left';
  }

  function drawCurves(g, series, columns, top, bottom, x, right) {
    const data = series.map(one => columns.series[one.name]);
    let least = 0,
      most = series[0].plot === 'closeness' ? 1 : 0;
    for (const one of data) {
      for (const v of one.least) if (v !== null && v < least) least = v;
      for (const v of one.greatest) if (v !== null && v > most) most = v;
    }
    if (most - least < 1e-6) most = least + 1;
    const y = v => bottom - ((v - least) / (most - least)) * (bottom - top);
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
    const count = data[0].least.length,
      span = (columns.to - columns.from) / count;
    series.forEach((one, k) => {
      g.strokeStyle = kPlotColours[k % kPlotColours.length];
      g.lineWidth = 1.2;
      g.beginPath();
      let last = -Infinity;
      for (let i = 0; i < count; ++i) {
        const low = data[k].least[i],
          high = data[k].greatest[i];
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

  function drawStates(g, series, columns, top, x, right) {
    const row = 18;
    series.forEach((one, k) => {
      const data = columns.series[one.name],
        count = data.least.length,
        span = (columns.to - columns.from) / count,
        y = top + k * row;
      g.fillStyle = '#8d99a6';
      g.textAlign = 'right';
      g.fillText(one.label, kLeft - 5, y + 11);
      const colour = value =>
        one.name === 'contact' ? (value ? '#e5484d' : '#28313a') : (kStateColours[value] ?? '#5d6873');
      let held = null,
        heldAt = -Infinity;
      for (let i = 0; i < count; ++i) {
        let low = data.least[i],
          high = data.greatest[i];
        if (low === null && held !== null && (i - heldAt) * span < kConnected_s) low = high = held;
        else if (low !== null) {
          held = high;
          heldAt = i;
        }
        if (low === null) continue;
        const left = x(columns.from + i * span),
          wide = x(columns.from + (i + 1) * span) - left + 0.5;
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

  return {left: kLeft, right: kRight, height, drawTimeLine, drawPlots};
})();
