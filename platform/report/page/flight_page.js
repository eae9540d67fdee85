// The page: one moment, chosen by slider, keys, charts or events, and everything drawn for it.

const $ = id => document.getElementById(id);

/** What is embedded in the page, deflated and in base64. */
async function unpack() {
  const bytes = Uint8Array.from(atob($('story').textContent.trim()), c => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate')));
}

function read_theme() {
  const style = getComputedStyle(document.documentElement), theme = {};
  for (const name of ['paper', 'ink', 'quiet', 'line', 'panel', 'blue', 'orange', 'green', 'red', 'sky', 'pink', 'free', 'known'])
    theme[name] = style.getPropertyValue(`--${name}`).trim();
  theme.dark = parseInt(theme.paper.slice(1, 3), 16) < 128;
  return theme;
}

/** What there is to draw over time. A chart without a value is left out. */
function charts_of(story, axis, choose) {
  const d = story.decision, s = story.state, parent = $('charts');
  const of = (from, name, values, colour, dash, step) => ({ name, times: from.time_s, values, colour, dash, step });
  const stages = [['point_cloud', 'sky'], ['governor', 'quiet'], ['map', 'blue'], ['export', 'green'], ['planner', 'orange'], ['smoother', 'pink']];
  const list = [
    new Chart(parent, axis, { title: 'Speed', unit: 'm/s', series: [
      of(s, 'flown', s.speed_mps, 'blue'), of(s, 'reference', s.ref_speed_mps, 'green', [3, 3]),
      of(d, 'limit', d.speed_limit_mps, 'red', [8, 4], true)] }, choose),
    new Chart(parent, axis, { title: 'Latency by stage, against the deadline', unit: 's',
      stack: stages.map(([name, colour]) => of(d, name.replace('_', ' '), d[`${name}_s`], colour)),
      series: [of(d, 'deadline', d.deadline_s, 'red', [8, 4], true)] }, choose),
    new Chart(parent, axis, { title: 'Precision', unit: 'm', logarithmic: true, series: [
      of(d, 'map p0', d.p0_m, 'blue', [], true), of(d, 'plan p1', d.p1_m, 'orange', [6, 3], true),
      of(d, 'asked for', d.demand_m, 'quiet', [2, 3], true)] }, choose),
    new Chart(parent, axis, { title: 'Volume', unit: '1000 m\u00b3', series: [['perceived v0', 'v0_m3', 'blue', []], ['exported v1', 'v1_m3', 'green', [6, 3]],
      ['planned v2', 'v2_m3', 'orange', [2, 3]]].map(([name, key, colour, dash]) =>
        of(d, name, d[key].map(v => v === null ? null : v / 1000), colour, dash, true)) }, choose),
    new Chart(parent, axis, { title: 'Battery', unit: '%', most: 100, series: [
      of(s, 'left', s.battery_ratio.map(v => v === null ? null : 100 * v), 'green')] }, choose),
    new Bands(parent, axis, { title: 'Phases and failsafe', marks: story.events.map(e => e.time_s), bands: bands_of(story, axis) }, choose)];
  return list.filter(chart => { if (chart.empty) chart.box.remove(); return !chart.empty; });
}

/** What the flight did from one moment to the next: its phases, and from each action of the failsafe on that action and why. */
function bands_of(story, axis) {
  const s = story.state, colours = { hold: 'sky', return: 'orange', land: 'orange', terminate: 'red', kill: 'red' }, starts = [];
  s.phase.forEach((phase, i) => {
    if (phase && phase !== s.phase[i - 1]) starts.push({ name: phase, from: s.time_s[i], colour: colours[phase] || 'green' });
  });
  for (const f of story.failsafe) starts.push({ name: words_of_failsafe(f), from: f.time_s, colour: colours[f.action] || 'green' });
  starts.sort((a, b) => a.from - b.from);
  // A phase that an action began has its band already.
  const bands = starts.filter((b, i) => i === 0 || !(starts[i - 1].name.startsWith(b.name) && b.from - starts[i - 1].from < 0.5));
  bands.forEach((b, i) => { b.until = bands[i + 1]?.from ?? axis.until; });
  return bands;
}

function words_of_failsafe(f) {
  const because = f.conditions.concat(f.sensor ? [f.sensor] : []).join(', ');
  return `${f.action}${f.phase ? ` (${f.phase})` : ''}${because ? `: ${because}` : ''}`;
}

class Page {
  constructor(story) {
    this.story = story;
    const times = story.state.time_s.concat(story.decision.time_s, story.failsafe.map(f => f.time_s), story.events.map(e => e.time_s));
    const ends = times.reduce(([a, b], t) => [Math.min(a, t), Math.max(b, t)], [Infinity, -Infinity]);
    this.axis = new TimeAxis(...ends);
    const choose = t => this.go(t);
    this.scene = new Scene($('scene'), story);
    this.cameras = new Cameras(story.camera);
    this.charts = charts_of(story, this.axis, choose);
    this.choose = choose;
    Object.assign($('time'), { min: this.axis.from, max: this.axis.until });
    this.show_verdict();
    this.list_facts();
    $('note').textContent = story.notes.join('\n');
    this.list_events();
    this.listen();
    this.t = this.axis.from;
    this.repaint();
  }
  /** Of a scenario: whether it passed, and all that did not hold. A sign beside the colour: it is read without seeing colours. */
  show_verdict() {
    const verdict = this.story.verdict;
    if (!verdict) return;
    const lines = [verdict.passed ? '\u2713 The scenario passed.' : '\u2717 The scenario FAILED:', ...verdict.complaints];
    $('verdict').className = verdict.passed ? 'good' : 'bad';
    $('verdict').replaceChildren(...lines.map(textContent => Object.assign(document.createElement('p'), { textContent })));
    if (verdict.moment_s !== null) {
      const show = Object.assign(document.createElement('button'), { type: 'button', textContent: `Show ${verdict.moment_s.toFixed(2)} s` });
      show.addEventListener('click', () => this.go(verdict.moment_s));
      $('verdict').append(show);
    }
    $('verdict').hidden = false;
  }
  list_facts() {
    $('facts').replaceChildren(...this.story.facts.map(([name, value]) => {
      const row = document.createElement('div');
      row.append(Object.assign(document.createElement('dt'), { textContent: name }), Object.assign(document.createElement('dd'), { textContent: value }));
      return row;
    }));
  }
  list_events() {
    $('events').replaceChildren();
    const rows = this.story.events.map(e => [e.time_s, e.text, '']).concat(this.story.failsafe.map(f => [f.time_s, `failsafe: ${f.action}`,
      [f.phase, ...f.conditions, f.sensor].filter(Boolean).join(', ')])).sort((a, b) => a[0] - b[0]);
    this.rows = rows.map(([time, what, more]) => {
      const row = document.createElement('tr');
      for (const text of [`${time.toFixed(2)} s`, what, more]) row.append(Object.assign(document.createElement('td'), { textContent: text }));
      row.tabIndex = 0;
      row.addEventListener('click', () => this.go(time));
      row.addEventListener('keydown', e => { if (e.key === 'Enter') this.go(time); });
      $('events').append(row);
      return { time, row };
    });
    $('happened').hidden = rows.length === 0;
  }
  listen() {
    $('time').addEventListener('input', () => this.go(Number($('time').value)));
    for (const [id, yaw, pitch] of [['top', 0, Math.PI / 2], ['side', 0, 0.08], ['slant', -0.55, 0.75]])
      $(id).addEventListener('click', () => { this.scene.look_from(yaw, pitch); this.draw(); });
    $('follow').addEventListener('change', () => { this.scene.follow_closely($('follow').checked); this.draw(); });
    $('play').addEventListener('click', () => this.play(!this.playing));
    document.addEventListener('keydown', e => this.key(e));
    const repaint = () => this.repaint();
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', repaint);
    matchMedia('print').addEventListener('change', repaint);
    window.addEventListener('beforeprint', repaint);
    window.addEventListener('afterprint', repaint);
    window.addEventListener('resize', () => this.draw());
  }
  key(e) {
    if (e.ctrlKey || e.altKey || e.metaKey || e.target.closest?.('form') || (e.key === ' ' && (e.target.tagName === 'BUTTON' || e.target.type === 'checkbox'))) return;
    const turn = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
    if (turn) this.go(e.shiftKey ? this.t + 10 * turn : this.beside(turn));
    else if (e.key === 'Home') this.go(this.axis.from);
    else if (e.key === 'End') this.go(this.axis.until);
    else if (e.key === ' ') this.play(!this.playing);
    else if (e.key === '+' || e.key === '-') this.scene.zoom(e.key === '+' ? 1.25 : 0.8);
    else return;
    e.preventDefault();
  }
  /** The decision before (-1) or behind (1) this moment. */
  beside(turn) {
    const times = this.story.decision.time_s, at = index_at(times, this.t + 1e-6);
    if (turn > 0) return times[at + 1] ?? this.axis.until;
    return at >= 0 && times[at] < this.t - 1e-6 ? times[at] : times[at - 1] ?? this.axis.from;
  }
  play(on) {
    this.playing = on;
    $('play').setAttribute('aria-pressed', on); $('play').textContent = on ? 'Pause' : 'Play';
    let before = performance.now();
    const frame = now => {
      if (!this.playing) return;
      // If nobody says otherwise, a minute for a flight of any length, and never slower than the flight was.
      const rate = this.rate ?? Math.max(1, (this.axis.until - this.axis.from) / 60);
      const t = this.t + rate * (now - before) / 1000;
      before = now;
      this.go(t);
      if (t >= this.axis.until) this.play(false); else requestAnimationFrame(frame);
    };
    if (on && this.t >= this.axis.until) this.t = this.axis.from;
    if (on) requestAnimationFrame(frame);
  }
  /** The story has become longer. Who looks at its end goes with it. */
  grow(until_s) {
    const at_end = this.t >= this.axis.until - 1e-6;
    this.axis.until = Math.max(this.axis.until, until_s);
    $('time').max = this.axis.until;
    if (at_end) this.go(this.axis.until); else this.draw();
  }
  /** What is made of whole lists once more. */
  renew() {
    this.scene.measure();
    $('charts').replaceChildren();
    this.charts = charts_of(this.story, this.axis, this.choose);
    this.list_events();
    this.legend();
  }
  go(t) {
    this.t = Math.min(this.axis.until, Math.max(this.axis.from, t));
    $('time').value = this.t;
    this.draw();
  }
  repaint() { this.theme = read_theme(); this.legend(); this.draw(); }
  legend() {
    const theme = this.theme, line = (colour, words) => `<span><i style="border-color:${colour}"></i>${words}</span>`;
    const box = (colour, words) => `<span><i class="box" style="background:${colour}"></i>${words}</span>`;
    $('legend').innerHTML = line(speed_colour(0, theme), 'flown, slow') + line(speed_colour(1, theme), `flown, ${this.scene.top_speed.toFixed(1)} m/s`) +
      line(theme.red, 'planned') + (this.story.map.length ? box(theme.free, 'known to be free') + box(theme.known, 'known to be occupied, at its height then') : '') +
      (this.story.world ? line(theme.quiet, 'what truly stands there') : '');
  }
  explain(why) {
    if (why === this.why) return;
    this.why = why;
    $('why').replaceChildren(...why.split('\n').map(line => {
      const text = Object.assign(document.createElement('div'), { textContent: line + '\n' });
      text.style.setProperty('--in', `${/^ *\S.*?  +|^ */.exec(line)[0].length}ch`);
      return text;
    }));
  }
  draw() {
    const d = this.story.decision, s = this.story.state, at = index_at(d.time_s, this.t + 1e-6), now = Math.max(0, index_at(s.time_s, this.t));
    $('clock').textContent = `${this.t.toFixed(2)} s`;
    $('when').textContent = at < 0 ? 'Before the first decision' : `Decision ${at + 1} of ${d.time_s.length}, ${d.time_s[at].toFixed(2)} s`;
    $('doing').textContent = `at (${[s.x_m, s.y_m, s.z_m].map(v => v[now].toFixed(1)).join(', ')}) m, ${s.speed_mps[now].toFixed(1)} m/s` +
      (s.phase[now] ? `, ${s.phase[now]}` : '');
    this.explain(at < 0 ? 'Nothing was decided yet.' : d.why[at] || 'The log holds no reasons.');
    this.cameras.draw(this.t, this.theme);
    this.scene.draw(this.t, this.theme, $('follow').checked);
    for (const chart of this.charts) chart.draw(this.t, this.theme);
    const last = this.rows.findLast(r => r.time <= this.t + 1e-6);
    for (const r of this.rows) r.row.classList.toggle('now', r === last);
  }
}
