// The page of a flight that it flies itself. The address says which (#world=14&vehicle=paper&design=aware&seed=1), so that it can be
// passed on; a worker flies it, and its messages make the story, as those of a served flight do.

const kKeys = ['world', 'vehicle', 'design', 'seed'], kDefault = { world: '14', vehicle: 'paper', design: 'aware', seed: '1' };
const kForm = `<form id="choice" aria-label="Which flight">
  <label>world <select id="world"></select></label>
  <label>vehicle <select id="vehicle"></select></label>
  <label>design <select id="design"></select></label>
  <label>seed <input id="seed" type="number" min="0" step="1" required></label>
  <button id="fly">Fly</button>
  <button type="button" id="stop" disabled>Stop</button>
  <label>watch <select id="rate">
    <option value="">as fast as it is flown</option><option value="1">in real time</option><option value="4">4 times as fast</option>
    <option value="16">16 times as fast</option></select></label>
  <output id="progress" role="status"></output>
</form>
<p class="keys">The same flight by the program: <code id="command"></code></p>`;

const asked = new URLSearchParams(location.hash.slice(1)), flown = kKeys.some(key => asked.has(key));
const flight = kKeys.map(key => asked.get(key) ?? kDefault[key]);

function empty_story() {
  const lists = keys => Object.fromEntries(keys.map(key => [key, []]));
  const stages = ['point_cloud', 'governor', 'map', 'export', 'planner', 'smoother'].map(name => `${name}_s`);
  return { facts: [], notes: [], bounds: null, start: null, goal: null, fence: [], plan: [], map: [], camera: [], failsafe: [], events: [],
    state: lists(['time_s', 'x_m', 'y_m', 'z_m', 'speed_mps', 'ref_speed_mps', 'battery_ratio', 'phase']),
    decision: lists(['time_s', 'speed_limit_mps', 'deadline_s', 'p0_m', 'p1_m', 'demand_m', 'v0_m3', 'v1_m3', 'v2_m3', ...stages, 'why']) };
}

function facts_of(result, real_time_factor) {
  const number = (key, unit) => `${result[key].toFixed(1)} ${unit}`;
  return [['outcome', result.collided ? 'collision' : result.reason], ['state_hash', result.state_hash], ['time', number('mission_time_s', 's')],
    ['distance', number('distance_m', 'm')], ['fastest', number('max_velocity_mps', 'm/s')], ['mean', number('mean_velocity_mps', 'm/s')],
    ['energy', number('energy_kJ', 'kJ')], ['decisions', result.decisions], ['deadlines missed', result.deadline_misses],
    ['flown here', `${real_time_factor.toFixed(1)} times real time`]];
}

/** The same flight by the program. */
function command_of([world, vehicle, design, seed]) {
  const rest = `--vehicle ${vehicle} --design ${design} --seed ${seed}`;
  return /^\d+$/.test(world) ? `roborun fly --env ${world} ${rest}`
    : `roborun world make ${world} --vehicle ${vehicle} --seed ${seed} --out ${world}.toml && roborun fly --world ${world}.toml ${rest}`;
}

class WebFlight {
  constructor() { Object.assign(this, { story: empty_story(), page: null, growth: null, queue: [], result: null, begin_ms: performance.now() }); }
  take(message) {
    this.queue.push(message);
    if (this.queue.length === 1) requestAnimationFrame(() => this.work());
  }
  work() {
    const messages = this.queue.map(([topic, t, text]) => [topic, t, JSON.parse(text)]);
    this.queue = [];
    const ended = messages.find(([topic]) => topic === 'ended');
    for (const [topic, , m] of messages) {
      if (topic === '/configuration') Object.assign(this.story, { bounds: [m.flight.min_W, m.flight.max_W], start: m.start_m, goal: m.flight.goal_W });
      if (topic === '/world') this.story.world = m;
      if (topic === '/result') this.result = m;
    }
    if (!this.page) this.open(messages); else this.growth.take(messages);
    if (this.page && !ended) $('progress').value = `${this.page.axis.until.toFixed(0)} s flown, ${(1000 * this.page.axis.until / (performance.now() - this.begin_ms)).toFixed(0)} times real time`;
    if (ended && this.result) this.end(ended[1]);
  }
  open(messages) {
    for (const [topic, t, m] of messages) kTake[topic]?.(this.story, t, m);
    if (this.story.state.time_s.length === 0) return;
    document.documentElement.dataset.ready = 'yes';
    this.page = window.page = new Page(this.story);
    this.growth = new Growth(this.page);
    watch(this.page);
  }
  end(wall_s) {
    this.story.facts = facts_of(this.result, this.result.mission_time_s / wall_s);
    this.growth.renew();
    this.page.list_facts();
    $('progress').value = 'ended';
    $('stop').disabled = true;
    document.documentElement.dataset.ended = 'yes';
  }
}

/** At the chosen speed, or at the end of what is flown. */
function watch(page) {
  const rate = Number($('rate').value);
  if (rate > 0) { page.rate = rate; page.play(true); return; }
  page.rate = undefined;
  page.play(false);
  page.go(page.axis.until);
}

function say(words) { $('note').textContent = words; document.documentElement.dataset.refused = 'yes'; }

function offer(choices) {
  const list = (id, options) => $(id).replaceChildren(...options.map(([value, text]) => new Option(text, value)));
  list('world', choices.worlds);
  list('vehicle', choices.vehicles.map(name => [name, name]));
  list('design', choices.designs.map(name => [name, name]));
  kKeys.forEach((key, i) => { $(key).value = flight[i]; });
  $('build').textContent = choices.build;
  $('command').textContent = command_of(flight);
  document.documentElement.dataset.choices = 'yes';
}

async function start() {
  document.querySelector('h1').insertAdjacentHTML('afterend', kForm);
  const chosen = () => kKeys.map(key => $(key).value);
  $('choice').addEventListener('input', () => { $('command').textContent = command_of(chosen()); });
  $('choice').addEventListener('submit', e => {
    e.preventDefault();
    location.hash = new URLSearchParams(chosen().map((value, i) => [kKeys[i], value]));
    location.reload();
  });
  const wasm = await (await unpack()).arrayBuffer();
  const worker = new Worker(URL.createObjectURL(new Blob([$('worker').textContent], { type: 'text/javascript' })));
  const web = new WebFlight();
  $('stop').disabled = !flown;
  $('stop').addEventListener('click', () => { worker.terminate(); $('stop').disabled = true; $('progress').value = 'stopped'; });
  $('rate').addEventListener('change', () => { if (web.page) watch(web.page); });
  worker.onerror = e => say(`The flight broke off: ${e.message}`);
  worker.onmessage = ({ data }) => {
    if (data[0] === 'choices') offer(JSON.parse(data[2]));
    else if (data[0] === 'refused') { say(data[2]); $('stop').disabled = true; }
    else web.take(data);
  };
  worker.postMessage({ wasm, flight: flown ? flight : null }, [wasm]);
}

start().catch(error => {
  say(`This page cannot fly: ${error.message}. It needs a browser of 2023 or newer.`);
  throw error;
});
