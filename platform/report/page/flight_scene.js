'use strict';
// The flight in space, drawn on a canvas in parallel projection: a plane is then one affine transform of a picture, and
// lengths stay comparable. World frame: x east, y north, z up, metres.

/** Index of the last value that is not above t; -1: none. `times` ascends. */
function index_at(times, t) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle + 1; else high = middle;
  }
  return low - 1;
}

/** What the vehicle's map had told at its height until a moment: later slices over earlier ones. */
class KnownMap {
  static kUnknown = 0; static kFree = 1; static kOccupied = 2;
  static kMostPixels = 4e6; static kKeyEvery = 40;

  constructor(slices) {
    this.slices = slices;
    this.times = slices.map(s => s.time_s);
    this.done = -1;
    this.keys = [];
    if (slices.length === 0) return;
    const low = k => Math.min(...slices.map(s => s[k]));
    const high = (k, n) => Math.max(...slices.map(s => s[k] + s[n] * s.cell_m));
    this.x = low('x_m'); this.y = low('y_m');
    const wide = high('x_m', 'columns') - this.x, deep = high('y_m', 'rows') - this.y;
    this.cell = Math.max(low('cell_m'), Math.sqrt(wide * deep / KnownMap.kMostPixels));
    this.columns = Math.ceil(wide / this.cell) + 1;
    this.rows = Math.ceil(deep / this.cell) + 1;
    this.cells = new Uint8Array(this.columns * this.rows);
    this.free = this.layer(); this.occupied = this.layer();
  }
  layer() {
    const canvas = document.createElement('canvas');
    canvas.width = this.columns; canvas.height = this.rows;
    return canvas;
  }
  paint(slice) {
    const ratio = slice.cell_m / this.cell;
    const wide = Math.max(1, Math.round(ratio));
    const left = Math.round((slice.x_m - this.x) / this.cell), bottom = Math.round((slice.y_m - this.y) / this.cell);
    let at = 0;
    for (let k = 0; k < slice.runs.length; k += 2) {
      const value = slice.runs[k];
      for (let n = slice.runs[k + 1]; n > 0; --n, ++at) {
        if (value === KnownMap.kUnknown) continue;
        const column = left + Math.floor((at % slice.columns) * ratio), row = bottom + Math.floor(Math.floor(at / slice.columns) * ratio);
        for (let j = 0; j < wide; ++j)
          this.cells.fill(value, (row + j) * this.columns + column, (row + j) * this.columns + column + wide);
      }
    }
  }
  /** True if the picture has changed. */
  advance(t, colours) {
    const wanted = index_at(this.times, t);
    if (wanted === this.done && colours === this.colours) return false;
    if (wanted < this.done) {
      const key = Math.min(this.keys.length, Math.floor((wanted + 1) / KnownMap.kKeyEvery)) - 1;
      if (key < 0) this.cells.fill(0); else this.cells.set(this.keys[key]);
      this.done = (key + 1) * KnownMap.kKeyEvery - 1;
    }
    while (this.done < wanted) {
      this.paint(this.slices[++this.done]);
      if ((this.done + 1) % KnownMap.kKeyEvery === 0 && this.keys.length === (this.done + 1) / KnownMap.kKeyEvery - 1)
        this.keys.push(this.cells.slice());
    }
    this.colours = colours;
    this.upload(this.free, KnownMap.kFree, colours.free);
    this.upload(this.occupied, KnownMap.kOccupied, colours.known);
    return true;
  }
  upload(canvas, value, colour) {
    const context = canvas.getContext('2d');
    const image = context.createImageData(this.columns, this.rows);
    const word = new Uint32Array(image.data.buffer);
    const [r, g, b] = [1, 3, 5].map(i => parseInt(colour.slice(i, i + 2), 16));
    const packed = (255 << 24 | b << 16 | g << 8 | r) >>> 0;
    for (let i = 0; i < word.length; ++i) if (this.cells[i] === value) word[i] = packed;
    context.putImageData(image, 0, 0);
  }
}

class Scene {
  constructor(canvas, story) {
    this.canvas = canvas; this.story = story;
    this.measure();
    this.look_from(-0.55, 0.75);
    this.listen();
  }
  /** All that follows from the story. */
  measure() {
    const story = this.story;
    this.map = new KnownMap(story.map);
    this.plan_times = story.plan.map(p => p.time_s);
    const s = story.state;
    const points = s.x_m.map((x, i) => [x, s.y_m[i], s.z_m[i]]).concat([story.start, story.goal].filter(Boolean));
    const side = f => [0, 1, 2].map(k => f(...points.map(p => p[k])));
    // As arguments: the reader keeps 12,000 states at most.
    this.low = side(Math.min); this.high = side(Math.max);
    this.ground = story.bounds ? Math.min(story.bounds[0][2], this.low[2]) : this.low[2];
    this.top_speed = Math.max(1, ...s.speed_mps);
  }
  look_from(yaw, pitch) { this.yaw = yaw; this.pitch = pitch; this.centre = null; }
  fit() {
    this.centre = [0, 1, 2].map(k => (this.low[k] + this.high[k]) / 2);
    this.scale = 1;
    let wide = 1, tall = 1;
    for (let i = 0; i < 8; ++i) {
      const [x, y] = this.at([0, 1, 2].map(k => (i >> k & 1) ? this.high[k] : this.low[k]));
      wide = Math.max(wide, Math.abs(x - this.width / 2)); tall = Math.max(tall, Math.abs(y - this.height / 2));
    }
    this.scale = Math.min((this.width / 2 - 40) / wide, (this.height / 2 - 40) / tall, 40);
  }
  /** Near enough to see obstacles, or the whole flight again. */
  follow_closely(on) {
    const kAround_m = 50;
    if (on) this.scale = Math.max(this.scale, Math.min(this.width, this.height) / kAround_m); else this.centre = null;
  }
  /** World point to canvas point. */
  at(p) {
    const x = p[0] - this.centre[0], y = p[1] - this.centre[1], z = p[2] - this.centre[2];
    const c = Math.cos(this.yaw), s = Math.sin(this.yaw);
    return [this.width / 2 + (x * c + y * s) * this.scale,
            this.height / 2 - ((y * c - x * s) * Math.sin(this.pitch) + z * Math.cos(this.pitch)) * this.scale];
  }
  listen() {
    const drag = { on: false };
    this.canvas.addEventListener('pointerdown', e => {
      Object.assign(drag, { on: true, x: e.clientX, y: e.clientY, moves: e.shiftKey || e.button === 1 });
      this.canvas.setPointerCapture(e.pointerId);
    });
    this.canvas.addEventListener('pointermove', e => {
      if (!drag.on) return;
      const dx = e.clientX - drag.x, dy = e.clientY - drag.y;
      drag.x = e.clientX; drag.y = e.clientY;
      if (drag.moves) this.move(-dx, dy);
      else { this.yaw -= dx * 0.008; this.pitch = Math.min(Math.PI / 2, Math.max(0, this.pitch + dy * 0.008)); }
      this.redraw();
    });
    this.canvas.addEventListener('pointerup', () => { drag.on = false; });
    this.canvas.addEventListener('wheel', e => {
      e.preventDefault();
      this.zoom(Math.exp(-e.deltaY * 0.0015));
    }, { passive: false });
  }
  zoom(times) {
    this.scale = Math.min(400, Math.max(0.05, this.scale * times));
    this.redraw();
  }
  move(right, up) {
    const c = Math.cos(this.yaw), s = Math.sin(this.yaw), along = up / Math.max(0.2, Math.sin(this.pitch)) / this.scale;
    this.centre[0] += right / this.scale * c - along * s;
    this.centre[1] += right / this.scale * s + along * c;
  }
  redraw() { this.draw(this.t, this.theme, this.follow); }

  draw(t, theme, follow) {
    Object.assign(this, { t, theme, follow });
    const ratio = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth; this.height = this.canvas.clientHeight;
    this.canvas.width = this.width * ratio; this.canvas.height = this.height * ratio;
    if (!this.centre) this.fit();
    const g = this.context = this.canvas.getContext('2d');
    this.ratio = ratio;
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.fillStyle = theme.paper; g.fillRect(0, 0, this.width, this.height);
    const now = Math.max(0, index_at(this.story.state.time_s, t));
    const s = this.story.state, p = [s.x_m[now], s.y_m[now], s.z_m[now]];
    if (follow) this.centre = p.slice();
    this.draw_ground(theme);
    this.draw_map(t, theme, p[2]);
    this.draw_world(theme);
    this.draw_path(now, theme);
    this.draw_plan(t, theme);
    this.draw_ends(theme);
    this.draw_vehicle(p, theme);
    this.draw_scale(theme);
  }
  line(points, colour, width, dash = []) {
    const g = this.context;
    g.beginPath();
    points.forEach((p, i) => { const [x, y] = this.at(p); if (i) g.lineTo(x, y); else g.moveTo(x, y); });
    g.strokeStyle = colour; g.lineWidth = width; g.setLineDash(dash); g.stroke(); g.setLineDash([]);
  }
  text(p, words, colour, dx = 8, dy = -8) {
    const [x, y] = this.at(p), g = this.context;
    g.font = '12px system-ui, sans-serif'; g.lineWidth = 3; g.strokeStyle = this.theme.paper; g.fillStyle = colour;
    g.strokeText(words, x + dx, y + dy); g.fillText(words, x + dx, y + dy);
  }
  draw_ground(theme) {
    const [a, b] = this.story.bounds || [this.low.map(v => v - 5), this.high.map(v => v + 5)];
    const span = Math.max(b[0] - a[0], b[1] - a[1]);
    const step = span > 400 ? 50 : span > 80 ? 10 : 5, z = this.ground;
    this.context.globalAlpha = 0.45;
    for (let x = Math.ceil(a[0] / step) * step; x <= b[0]; x += step) this.line([[x, a[1], z], [x, b[1], z]], theme.line, 0.7);
    for (let y = Math.ceil(a[1] / step) * step; y <= b[1]; y += step) this.line([[a[0], y, z], [b[0], y, z]], theme.line, 0.7);
    this.context.globalAlpha = 1;
    for (const h of this.story.bounds ? [a[2], b[2]] : [z])
      this.line([[a[0], a[1], h], [b[0], a[1], h], [b[0], b[1], h], [a[0], b[1], h], [a[0], a[1], h]], theme.line, 1);
    for (const ring of this.story.fence) this.line(ring.concat([ring[0]]).map(q => [q[0], q[1], z]), theme.red, 1.5, [8, 4]);
  }
  plane(image, z, alpha) {
    const g = this.context, m = this.map, k = this.ratio * this.scale * m.cell, c = Math.cos(this.yaw), s = Math.sin(this.yaw), up = Math.sin(this.pitch);
    const [x, y] = this.at([m.x, m.y, z]);
    g.save();
    g.setTransform(k * c, k * s * up, k * s, -k * c * up, x * this.ratio, y * this.ratio);
    g.imageSmoothingEnabled = false; g.globalAlpha = alpha;
    g.drawImage(image, 0, 0);
    g.restore();
  }
  /** What truly stands there: outlines on the ground and at the height of the cut, and the edges between them. */
  draw_world(theme) {
    const world = this.story.world, g = this.context;
    if (!world) return;
    const kSides = 14, heights = [this.ground, Math.max(world.height_m, this.ground)], across = [Math.cos(this.yaw), Math.sin(this.yaw)];
    const move = p => { const [x, y] = this.at(p); g.moveTo(x, y); }, go = p => { const [x, y] = this.at(p); g.lineTo(x, y); };
    g.beginPath();
    for (const [x, y, r] of world.circles) {
      for (const z of heights)
        for (let i = 0; i <= kSides; ++i) {
          const a = 2 * Math.PI * i / kSides;
          (i ? go : move)([x + r * Math.cos(a), y + r * Math.sin(a), z]);
        }
      for (const s of [-r, r]) heights.forEach((z, i) => (i ? go : move)([x + s * across[0], y + s * across[1], z]));
    }
    for (const ring of world.rings) {
      for (const z of heights) { move([...ring[ring.length - 1], z]); for (const p of ring) go([...p, z]); }
      for (const p of ring) heights.forEach((z, i) => (i ? go : move)([...p, z]));
    }
    g.strokeStyle = theme.quiet; g.lineWidth = 0.8; g.globalAlpha = 0.8; g.stroke(); g.globalAlpha = 1;
  }
  /** Free space flat, occupied cells 1 m thick, in layers, at the height of the newest slice. */
  draw_map(t, theme, z) {
    if (this.map.times.length === 0) return;  // of what was measured: the story may hold more by now
    this.map.advance(t, theme);
    if (this.map.done < 0) return;
    const height = this.map.slices[this.map.done].z_m ?? z, layers = 10;
    this.plane(this.map.free, height - 0.5, 0.75);
    for (let i = 0; i < layers; ++i) this.plane(this.map.occupied, height - 0.5 + i / layers, 0.35);
    this.plane(this.map.occupied, height + 0.5, 1);
  }
  draw_path(now, theme) {
    const s = this.story.state, kParts = 12;
    const point = i => [s.x_m[i], s.y_m[i], s.z_m[i]];
    const rest = [];
    for (let i = now; i < s.time_s.length; ++i) rest.push(point(i));
    this.context.globalAlpha = 0.5; this.line(rest, theme.quiet, 1.2, [2, 4]); this.context.globalAlpha = 1;
    let from = 0, part = -1;
    for (let i = 0; i <= now; ++i) {
      const here = Math.min(kParts - 1, Math.floor(kParts * s.speed_mps[i] / this.top_speed));
      if (here === part && i < now) continue;
      if (i > from) {
        const points = [];
        for (let k = from; k <= i; ++k) points.push(point(k));
        this.line(points, speed_colour(Math.max(0, part) / (kParts - 1), theme), 3);
      }
      from = i; part = here;
    }
  }
  draw_plan(t, theme) {
    const at = index_at(this.plan_times, t);
    if (at < 0) return;
    const flat = this.story.plan[at].points_m, points = [];
    for (let i = 0; i + 2 < flat.length; i += 3) points.push(flat.slice(i, i + 3));
    if (points.length === 0) return;
    this.line(points, theme.red, 2.5, [7, 4]);
    const [x, y] = this.at(points[points.length - 1]), g = this.context;
    g.strokeStyle = theme.red; g.lineWidth = 2; g.strokeRect(x - 4, y - 4, 8, 8);
  }
  draw_ends(theme) {
    const g = this.context;
    for (const [p, word] of [[this.story.start, 'start'], [this.story.goal, 'goal']]) {
      if (!p) continue;
      this.line([p, [p[0], p[1], this.ground]], theme.quiet, 1);
      const [x, y] = this.at(p);
      g.fillStyle = theme.ink; g.beginPath(); g.arc(x, y, 4, 0, 7); g.fill();
      this.text(p, word, theme.ink);
    }
  }
  draw_vehicle(p, theme) {
    const g = this.context;
    this.line([p, [p[0], p[1], this.ground]], theme.quiet, 1, [2, 2]);
    const [x, y] = this.at(p);
    g.beginPath(); g.arc(x, y, 7, 0, 7); g.fillStyle = theme.paper; g.fill();
    g.lineWidth = 3; g.strokeStyle = theme.blue; g.stroke();
    g.beginPath(); g.arc(x, y, 2.5, 0, 7); g.fillStyle = theme.blue; g.fill();
  }
  draw_scale(theme) {
    const g = this.context, metres = [1, 2, 5, 10, 20, 50, 100, 200, 500].find(m => m * this.scale > 50) || 1000;
    const x = 14, y = this.height - 14;
    g.fillStyle = theme.ink; g.fillRect(x, y, metres * this.scale, 2);
    g.font = '12px system-ui, sans-serif'; g.fillText(`${metres} m`, x, y - 5);
    const north = [Math.sin(this.yaw), -Math.cos(this.yaw) * Math.max(0.25, Math.sin(this.pitch))];
    const cx = this.width - 30, cy = this.height - 34;
    g.strokeStyle = theme.ink; g.lineWidth = 1.5; g.beginPath();
    g.moveTo(cx - 14 * north[0], cy - 14 * north[1]); g.lineTo(cx + 14 * north[0], cy + 14 * north[1]); g.stroke();
    g.textAlign = 'center'; g.fillText('N', cx + 22 * north[0], cy + 22 * north[1] + 4); g.textAlign = 'left';
  }
}

/** From slow to fast: dark to bright in a light that every eye sees (after the map cividis). */
function speed_colour(ratio, theme) {
  const stops = theme.dark ? [[78, 96, 140], [140, 140, 130], [254, 232, 96]] : [[20, 56, 120], [105, 110, 115], [214, 168, 20]];
  const at = Math.min(1.9999, Math.max(0, 2 * ratio)), i = Math.floor(at), f = at - i;
  return `rgb(${[0, 1, 2].map(k => Math.round(stops[i][k] * (1 - f) + stops[i + 1][k] * f)).join(',')})`;
}
