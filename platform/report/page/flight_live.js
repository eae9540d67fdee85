// A page that a flight serves while it goes on: the topics of its log over the Foxglove WebSocket protocol make the story longer.

/** What a message adds to the story; as mission/flight_story does it from a log. False: it was there already. */
const kTake = {
  '/state': (story, t, m) => {
    const s = story.state;
    if (t <= s.time_s.at(-1)) return false;
    const v = [m.ref_vx_mps, m.ref_vy_mps, m.ref_vz_mps];
    for (const key of ['x_m', 'y_m', 'z_m', 'speed_mps', 'battery_ratio']) s[key].push(m[key] ?? null);
    s.ref_speed_mps.push(v.some(x => x === null || x === undefined) ? null : Math.hypot(...v));
    s.time_s.push(t); s.phase.push(m.phase);
    return true;
  },
  '/decision': (story, t, m) => {
    const d = story.decision;
    if (t <= (d.time_s.at(-1) ?? -1)) return false;
    for (const key of Object.keys(d)) d[key].push(key === 'why' ? m.why.join('\n') : m[key] ?? null);
    return true;
  },
  '/trajectory': (story, t, m) => add(story.plan, { time_s: t, points_m: m.poses.flatMap(p => [p.position.x, p.position.y, p.position.z]) }),
  '/map': (story, t, m) => {
    const cells = atob(m.data), runs = [], p = m.pose.position;
    for (let i = 0, end = 0; i < cells.length; i = end) {
      while (end < cells.length && cells[end] === cells[i]) ++end;
      runs.push({ 0: 1, 100: 2 }[cells.charCodeAt(i)] ?? 0, end - i);
    }
    return add(story.map, { time_s: t, x_m: p.x, y_m: p.y, z_m: p.z, cell_m: m.cell_size.x, columns: m.column_count, rows: cells.length / m.column_count, runs });
  },
  '/failsafe': (story, t, m) => add(story.failsafe, { ...m, time_s: t }),
  '/events': (story, t, m) => m.name !== 'failsafe' && add(story.events, { time_s: t, text: m.message }),
};
function add(list, one) {
  if (list.some(other => other.time_s === one.time_s && JSON.stringify(other) === JSON.stringify(one)) || one.time_s < (list.at(-1)?.time_s ?? 0)) return false;
  list.push(one);
  return true;
}

/** Puts messages into the story of a page, which is drawn again as it grows. */
class Growth {
  static kRenew_ms = 1000;
  constructor(page) { Object.assign(this, { page, renewed: performance.now(), stale: false }); }
  /** `messages`: [topic, time in seconds, message] each. */
  take(messages) {
    const taken = messages.filter(([topic, t, m]) => kTake[topic]?.(this.page.story, t, m));
    if (taken.length === 0) return;
    this.stale ||= taken.some(([topic]) => topic !== '/state');
    this.page.grow(Math.max(...taken.map(([, t]) => t)));
    if (this.stale && performance.now() - this.renewed >= Growth.kRenew_ms) this.renew();
  }
  renew() {
    this.renewed = performance.now(); this.stale = false;
    this.page.renew(); this.page.draw();
  }
}

function follow_flight(page) {
  const socket = new WebSocket(`ws://${location.host}/`, 'foxglove.websocket.v1'), topic = {}, growth = new Growth(page);
  socket.binaryType = 'arraybuffer';
  socket.addEventListener('message', e => {
    if (typeof e.data === 'string') {
      const channels = (JSON.parse(e.data).channels ?? []).filter(c => kTake[c.topic]);
      for (const c of channels) topic[c.id] = c.topic;
      if (channels.length) socket.send(JSON.stringify({ op: 'subscribe', subscriptions: channels.map(c => ({ id: c.id, channelId: c.id })) }));
      return;
    }
    const view = new DataView(e.data), t = Number(view.getBigInt64(5, true)) / 1e9;
    growth.take([[topic[view.getUint32(1, true)], t, JSON.parse(new TextDecoder().decode(new Uint8Array(e.data, 13)))]]);
  });
  socket.addEventListener('close', () => {
    growth.renew();
    $('note').textContent = ['The flight has ended, or its program has. Its log has all of it: roborun report.', ...page.story.notes].join('\n');
  });
}
