// Charts over one time axis. A series is {name, times, values, colour, dash, step}; `stack` adds the values of one after the
// other. A value that is null is a gap.

/** About `count` round values from low to high. */
function round_steps(low, high, count) {
  const raw = (high - low) / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = [1, 2, 5, 10].find(k => k * power >= raw) * power, values = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) values.push(k * step);
  return values;
}
function words_of_number(x) {
  if (x === null || x === undefined || Number.isNaN(x)) return '-';
  return Math.abs(x) >= 100 ? x.toFixed(0) : Math.abs(x) >= 10 ? x.toFixed(1) : Math.abs(x) >= 0.1 || x === 0 ? x.toFixed(2) : x.toFixed(3);
}

const kLeft = 52, kRight = 10, kTop = 6, kBottom = 18;

class TimeAxis {
  constructor(from_s, until_s) { this.from = from_s; this.until = Math.max(until_s, from_s + 0.1); }
  x(t, width) { return kLeft + (t - this.from) / (this.until - this.from) * (width - kLeft - kRight); }
  time(x, width) {
    const t = this.from + (x - kLeft) / (width - kLeft - kRight) * (this.until - this.from);
    return Math.min(this.until, Math.max(this.from, t));
  }
}

/** The frame that all charts have: a heading with the values at the moment, a canvas, a click that chooses a moment. */
class Panel {
  constructor(parent, axis, title, choose, low) {
    this.axis = axis; this.title = title;
    this.box = document.createElement('div');
    this.box.className = low ? 'chart low' : 'chart';
    this.heading = document.createElement('p');
    this.canvas = document.createElement('canvas');
    this.canvas.setAttribute('role', 'img'); this.canvas.setAttribute('aria-label', `${title} over time`);
    this.box.append(this.heading, this.canvas);
    parent.append(this.box);
    const pick = e => choose(axis.time(e.offsetX, this.canvas.clientWidth));
    this.canvas.addEventListener('pointerdown', e => { this.canvas.setPointerCapture(e.pointerId); pick(e); });
    this.canvas.addEventListener('pointermove', e => { if (e.buttons) pick(e); });
  }
  /** An empty canvas with its time axis. */
  begin(theme) {
    const ratio = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth; this.height = this.canvas.clientHeight;
    this.canvas.width = this.width * ratio; this.canvas.height = this.height * ratio;
    const g = this.canvas.getContext('2d');
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.fillStyle = theme.paper; g.fillRect(0, 0, this.width, this.height);
    g.font = '11.5px system-ui, sans-serif'; g.fillStyle = theme.quiet; g.strokeStyle = theme.line; g.lineWidth = 1;
    g.textAlign = 'center';
    for (const t of round_steps(this.axis.from, this.axis.until, Math.max(2, this.width / 110))) {
      const x = this.axis.x(t, this.width);
      g.globalAlpha = 0.5; g.beginPath(); g.moveTo(x, kTop); g.lineTo(x, this.height - kBottom); g.stroke(); g.globalAlpha = 1;
      g.fillText(`${+t.toFixed(2)} s`, x, this.height - 4);
    }
    g.textAlign = 'right';
    return g;
  }
  cursor(g, t, theme) {
    const x = this.axis.x(t, this.width);
    g.setLineDash([]); g.strokeStyle = theme.ink; g.lineWidth = 1.5;
    g.beginPath(); g.moveTo(x, 0); g.lineTo(x, this.height - kBottom); g.stroke();
  }
  head(parts) {
    this.heading.replaceChildren(Object.assign(document.createElement('b'), { textContent: this.title }), ...parts);
  }
}

class Chart extends Panel {
  constructor(parent, axis, { title, unit, series, stack = [], logarithmic = false, most }, choose) {
    super(parent, axis, `${title} [${unit}]`, choose, false);
    this.series = series.filter(s => s.values.some(v => v !== null));
    this.stack = stack.filter(s => s.values.some(v => v));
    this.logarithmic = logarithmic;
    let high = 0, low = Infinity;
    for (const s of this.series) for (const v of s.values) if (v !== null) { if (v > high) high = v; if (v > 0 && v < low) low = v; }
    if (this.stack.length) this.stack[0].values.forEach((_, i) => { high = Math.max(high, this.sum(i)); });
    this.low = logarithmic ? low / 1.3 : 0;
    this.high = most ?? (logarithmic ? high * 1.3 : high * 1.08 || 1);
  }
  get empty() { return this.series.length + this.stack.length === 0; }
  sum(i) { return this.stack.reduce((total, s) => total + (s.values[i] || 0), 0); }
  y(v) {
    const ratio = this.logarithmic ? Math.log(Math.max(v, this.low) / this.low) / Math.log(this.high / this.low)
                                   : (v - this.low) / (this.high - this.low);
    return this.height - kBottom - Math.min(1, ratio) * (this.height - kBottom - kTop);
  }
  draw(t, theme) {
    const g = this.begin(theme);
    const marks = this.logarithmic ? [0.01, 0.02, 0.05, 0.1, 0.15, 0.3, 0.6, 1.2, 2.4, 4.8, 9.6, 20, 50, 100].filter(v => v >= this.low && v <= this.high)
                                   : round_steps(this.low, this.high, 4);
    let below = Infinity;
    for (const v of marks) {
      const y = this.y(v);
      if (below - y < 13) continue;
      below = y;
      g.fillStyle = theme.quiet; g.fillText(+v.toPrecision(4), kLeft - 6, y + 4);
      g.strokeStyle = theme.line; g.globalAlpha = 0.5;
      g.beginPath(); g.moveTo(kLeft, y); g.lineTo(this.width - kRight, y); g.stroke(); g.globalAlpha = 1;
    }
    this.draw_stack(g, theme);
    for (const s of this.series) this.draw_line(g, s, theme);
    this.cursor(g, t, theme);
    this.head([...this.stack, ...this.series].map(s => this.key(s, t, theme)));
  }
  /** One bar a decision, as long as the decision lasted: its latency. */
  draw_stack(g, theme) {
    if (this.stack.length === 0) return;
    const times = this.stack[0].times;
    for (let i = 0; i < times.length; ++i) {
      const x = this.axis.x(times[i], this.width), until = Math.min(times[i + 1] ?? this.axis.until, times[i] + this.sum(i));
      const wide = Math.max(1, this.axis.x(until, this.width) - x - 0.4);
      let from = 0;
      for (const s of this.stack) {
        const v = s.values[i] || 0;
        g.fillStyle = theme[s.colour]; g.globalAlpha = s.faint ? 0.5 : 1;
        g.fillRect(x, this.y(from + v), wide, this.y(from) - this.y(from + v));
        from += v;
      }
    }
    g.globalAlpha = 1;
  }
  draw_line(g, s, theme) {
    g.strokeStyle = theme[s.colour]; g.lineWidth = 1.8; g.setLineDash(s.dash || []);
    g.beginPath();
    let pen = false, before = 0;
    for (let i = 0; i < s.times.length; ++i) {
      const v = s.values[i];
      if (v === null) { pen = false; continue; }
      const x = this.axis.x(s.times[i], this.width), y = this.y(v);
      if (!pen) g.moveTo(x, y);
      else { if (s.step) g.lineTo(x, before); g.lineTo(x, y); }
      pen = true; before = y;
    }
    if (s.step && pen) g.lineTo(this.axis.x(this.axis.until, this.width), before);
    g.stroke(); g.setLineDash([]);
  }
  key(s, t, theme) {
    const at = index_at(s.times, t), span = document.createElement('span');
    const shape = this.stack.includes(s) ? `<rect width="12" height="12" fill="${theme[s.colour]}" opacity="${s.faint ? 0.5 : 1}"/>`
        : `<line x1="0" y1="6" x2="24" y2="6" stroke="${theme[s.colour]}" stroke-width="2.5" stroke-dasharray="${(s.dash || []).join(' ')}"/>`;
    span.innerHTML = `<svg width="${this.stack.includes(s) ? 12 : 24}" height="12" aria-hidden="true">${shape}</svg>`;
    span.append(`${s.name} ${at < 0 ? '-' : words_of_number(s.values[at])}`);
    return span;
  }
}

/** Bands of what held from one moment to the next, and marks of what happened. */
class Bands extends Panel {
  constructor(parent, axis, { title, bands, marks }, choose) {
    super(parent, axis, title, choose, true);
    this.bands = bands; this.marks = marks;
  }
  draw(t, theme) {
    const g = this.begin(theme), high = this.height - kBottom - kTop - 14;
    g.textAlign = 'left';
    for (const band of this.bands) {
      const x = this.axis.x(band.from, this.width), wide = this.axis.x(band.until, this.width) - x;
      g.fillStyle = theme[band.colour]; g.globalAlpha = 0.28; g.fillRect(x, kTop + 14, wide, high); g.globalAlpha = 1;
      g.fillRect(x, kTop + 14, 1.5, high);
      g.fillStyle = theme.ink;
      if (g.measureText(band.name).width + 8 < wide) g.fillText(band.name, x + 5, kTop + 14 + high / 2 + 4);
    }
    g.fillStyle = theme.ink;
    for (const time of this.marks) {
      const x = this.axis.x(time, this.width);
      g.beginPath(); g.moveTo(x - 4, kTop); g.lineTo(x + 4, kTop); g.lineTo(x, kTop + 9); g.fill();
    }
    this.cursor(g, t, theme);
    const now = this.bands.findLast(b => b.from <= t);
    this.head([Object.assign(document.createElement('span'), { textContent: now ? now.name : '' })]);
  }
}
