/* The user interface of the page: time, selection, plots, lists, keys. */

const element = id => document.getElementById(id);
const mostPlots = 4;

const state = {t: 0, playing: false, speed: 1, deflection: 1, body: -1, node: null, element: null, shown: [], dirty: true, last: 0, follow: false};
let run, model, view = null, plots = [], bodyPlots = [], usable = 1;

function say(text, bad) {
  element('message').textContent = text;
  element('message').classList.toggle('bad', !!bad);
  element('message').hidden = !text;
}

/* ---- time ---- */

const begin = () => run.time[0] || 0, end = () => run.time[run.time.length - 1] || 0;

/* The default speed: 1 if the run then takes 2 to 30 seconds, else 1, 2 or 5 times a power of ten, so that it takes about eight */
function naturalSpeed() {
  const length = end() - begin();
  return !(length > 0) || (length >= 2 && length <= 30) ? 1 : roundStep(length / 8, 1);
}

function changeSpeed(faster) {
  const power = 10 ** Math.floor(Math.log10(state.speed) + 1e-9), lead = Math.round(state.speed / power);
  state.speed = faster ? {1: 2, 2: 5, 5: 10}[lead] * power : {1: 0.5, 2: 1, 5: 2}[lead] * power;
  showSpeed();
}

function showSpeed() { element('speed').textContent = '×' + formatNumber(state.speed, 3); }

function play(on) {
  if (on && state.t >= end()) state.t = begin();
  state.playing = on && end() > begin();
  element('play').textContent = state.playing ? '❚❚' : '▶';
  element('play').setAttribute('aria-label', state.playing ? 'Pause' : 'Play');
  state.last = 0;
  wake();
}

function go(t) {
  state.t = Math.min(end(), Math.max(begin(), t));
  state.dirty = true;
  wake();
}

function goFrames(n) {
  play(false);
  const [k, part] = placeInTime(run, state.t), from = n < 0 && part > 0 ? k + 1 : k;
  go(run.time[Math.min(run.time.length - 1, Math.max(0, from + n))]);
}

/* ---- drawing, only when something has changed ---- */

let asked = false, nextPicture = f => requestAnimationFrame(f);
function wake() {
  if (asked) return;
  asked = true;
  nextPicture(now => {
    asked = false;
    tick(now);
  });
}

function change() {
  state.dirty = true;
  wake();
}

function tick(now) {
  if (state.playing) {
    if (state.last) state.t += state.speed * Math.min(0.25, (now - state.last) / 1000);
    state.last = now;
    if (state.t > end()) state.t = begin() + (state.t - end()) % (end() - begin());
    state.dirty = true;
  }
  if (state.dirty) draw();
  if (state.playing) wake();
}

function draw() {
  state.dirty = false;
  const place = placeInTime(run, state.t);
  if (view) {
    model.moveTo(state.t, state.deflection);
    if (state.follow && state.body >= 0) view.follow(state.body);
    else view.followed = undefined;
    view.draw();
    view.drawAxes(element('axes'));
    showTag();
  }
  const size = Math.max(Math.abs(begin()), Math.abs(end())), step = (end() - begin()) / 500 || size / 1000 || 1; // of a picture
  element('time').textContent = formatTimes([state.t, end()], size, step);
  element('scrub').value = end() > begin() ? Math.round(1e4 * (state.t - begin()) / (end() - begin())) : 0;
  element('scrub').setAttribute('aria-valuetext', 'time ' + formatTimes([state.t], size, step));
  for (const p of [...bodyPlots, ...plots]) p.draw(state.t, place);
}

/* Shows the name of the selected object beside it */
function showTag() {
  const tag = element('tag'), group = model.bodies[state.body];
  let text = group ? run.scene.bodies[state.body].name : '', at = group && group.visible ? group.position : null;
  if (state.element) [text, at] = [state.element.element, state.element.object.getWorldPosition(new THREE.Vector3())];
  else if (group && state.node) {
    const {surface, node} = state.node;
    at = new THREE.Vector3().fromArray(surface.now, 3 * node).applyMatrix4(surface.mesh.matrixWorld);
    if (surface.scale) text += ', ' + formatWithUnit(stressAt(surface, run, node, state.t), surface.unit, 3);
  }
  const p = at && text ? view.project(at) : null;
  tag.hidden = !p;
  if (!p) return;
  tag.textContent = text;
  const width = view.canvas.clientWidth, height = view.canvas.clientHeight;
  tag.style.transform = `translate(${Math.min(width - tag.offsetWidth - 4, Math.max(4, p[0] + 14))}px, ${Math.min(height - tag.offsetHeight - 4, Math.max(4, p[1] - 34))}px)`;
}

/* ---- selection and plots ---- */

/* Selects a body, a node of its surface, or a joint or force at it; picked: the result of View.pick() */
function select(body, node = null, picked = null) {
  if (model && view) {
    model.materials.forEach((m, k) => m.emissive.set(k === body ? 0x333333 : 0));
    for (const s of run.surfaces) s.mesh.material.emissive.set(s.body === body && model.colourBy === 'body' ? 0x222222 : 0);
  }
  state.body = body;
  element('follow').disabled = body < 0;
  setFollow(state.follow && body >= 0);
  state.node = node;
  state.element = picked;
  bodyPlots = body < 0 ? [] : [positionPlot(body)];
  if (node && node.surface.scale) bodyPlots.unshift(stressPlot(node));
  showPlots();
}

function positionPlot(body) {
  const series = ['x', 'y', 'z'].slice(0, run.scene.planar ? 2 : 3).map((name, c) => ({name, value: run.frame.map(f => f[7 * body + c])}));
  return new Plot(run.time, run.scene.bodies[body].name + (run.scene.bodies[body].mesh ? ': mean position of its surface' : ': position of the centre of mass'), '', series, scrubTo);
}

function stressPlot({surface, node}) {
  const value = surface.field.map(f => f.largest[node] * f.code[node] / 255);
  return new Plot(run.time, run.scene.bodies[surface.body].name + ': von Mises stress where selected', surface.unit, [{name: 'stress', value}], scrubTo);
}

const scrubTo = t => { play(false); go(t); };

function toggleChannel(c) {
  const at = state.shown.indexOf(c);
  if (at >= 0) state.shown.splice(at, 1);
  else state.shown.push(c);
  if (state.shown.length > mostPlots) state.shown.shift();
  plots = state.shown.map(k => plots.find(p => p.channel === k) || Object.assign(new Plot(run.time, run.scene.channels[k].name, run.scene.channels[k].unit, [{name: '', value: run.scene.channels[k].value || []}], scrubTo), {channel: k}));
  showPlots();
}

function showPlots() {
  element('plots').replaceChildren(...[...bodyPlots, ...plots].map(p => p.element));
  document.querySelectorAll('#lists [data-channel]').forEach(b => b.setAttribute('aria-pressed', state.shown.includes(Number(b.dataset.channel))));
  document.querySelectorAll('#lists [data-body]').forEach(b => b.setAttribute('aria-pressed', state.body === Number(b.dataset.body)));
  change();
}

/* Adds a list of buttons, with a search field if it is long */
function addList(title, entries, open) {
  if (!entries.length) return;
  const box = document.createElement('details'), head = document.createElement('summary'), list = document.createElement('ul');
  box.open = open;
  head.textContent = `${title} (${entries.length})`;
  box.append(head);
  if (entries.length > 12) {
    const search = document.createElement('input');
    search.type = 'search';
    search.placeholder = 'Search';
    search.setAttribute('aria-label', 'Search in ' + title.toLowerCase());
    search.addEventListener('input', () => { for (const li of list.children) li.hidden = !li.textContent.toLowerCase().includes(search.value.toLowerCase()); });
    box.append(search);
  }
  for (const e of entries) {
    const li = document.createElement('li'), button = document.createElement('button'), name = document.createElement('span');
    button.type = 'button';
    button.setAttribute('aria-pressed', 'false');
    Object.assign(button.dataset, e.data);
    name.textContent = e.name;
    if (e.colour) {
      const swatch = document.createElement('span');
      swatch.className = 'swatch';
      swatch.style.background = e.colour;
      button.append(swatch);
    }
    button.append(name);
    if (e.unit) {
      const unit = document.createElement('span');
      unit.className = 'unit';
      unit.textContent = e.unit;
      button.append(unit);
    }
    button.addEventListener('click', e.click);
    li.append(button);
    list.append(li);
  }
  box.append(list);
  element('lists').append(box);
}

function addLists() {
  addList('Channels', run.scene.channels.map((c, k) => ({name: c.name, unit: c.unit, data: {channel: k}, click: () => toggleChannel(k)})), true);
  const bodies = run.scene.bodies.map((b, k) => ({name: b.name, carrier: b.carrier, colour: model ? model.colourOf(k) : '', data: {body: k}, click: () => select(state.body === k ? -1 : k)}));
  addList('Bodies', bodies.filter(b => b.carrier < 0), !run.scene.channels.length);
}

/* ---- surfaces ---- */

/* Sets the factor of deflections from the slider, which is logarithmic, from 1 to the largest useful factor */
function setDeflection() {
  const x = 10 ** (element('deflection').value / 100 * Math.log10(usable));
  state.deflection = Number(x.toPrecision(x < 10 ? 2 : 1));
  element('deflection-value').textContent = '×' + formatNumber(state.deflection, 3);
  change();
}

function setColour(by) {
  model.colourBy = by;
  element('colour').value = by;
  element('legend').hidden = by !== 'stress';
  select(state.body, state.node);
}

function prepareSurfaces() {
  if (!run.surfaces.length) return;
  element('surface-tools').hidden = false;
  element('colour').parentElement.hidden = !model.scales.length;
  usable = Math.max(1, model.largestDeflection());
  element('deflection').parentElement.hidden = usable < 1.5;
  element('deflection').addEventListener('input', setDeflection);
  element('colour').addEventListener('change', e => setColour(e.target.value));
  if (!model.scales.length) return;
  element('legend').replaceChildren(...model.scales.map(legendOf));
  setColour('stress');
}

/* The legend of a colour scale; if there are several scales, with the names of the bodies of each */
function legendOf(scale) {
  const legend = document.createElement('div'), colours = stressStops.map(([x, colour]) => `${colour} ${100 * x}%`);
  legend.innerHTML = '<div class="name">von Mises</div><div class="bar"><div class="colours"></div><div class="ticks"></div></div>';
  if (model.scales.length > 1) legend.querySelector('.name').textContent += ', ' + scale.surfaces.map(s => run.scene.bodies[s.body].name).join(', ');
  legend.querySelector('.colours').style.background = `linear-gradient(to top, ${colours.join()})`;
  legend.title = 'Largest of the run: ' + formatWithUnit(scale.largest, scale.unit, 3) + '. The colours end where 99 % of the nodes stay below.';
  legend.querySelector('.ticks').replaceChildren(...[1, 0.75, 0.5, 0.25, 0].map(x => {
    const tick = document.createElement('span');
    tick.textContent = x ? (x === 1 ? '≥ ' : '') + formatWithUnit(x * scale.top, scale.unit, 3) : '0';
    return tick;
  }));
  return legend;
}

/* ---- light and dark ---- */

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  if (view) view.setTheme();
  if (run) change();
}

function prepareTheme() {
  const system = window.matchMedia('(prefers-color-scheme: dark)');
  let chosen = null;
  try { chosen = localStorage.getItem('hhtdae-theme'); } catch (e) { /* some browsers have no storage for local files */ }
  setTheme(chosen || (system.matches ? 'dark' : 'light'));
  system.addEventListener('change', () => { if (!chosen) setTheme(system.matches ? 'dark' : 'light'); });
  return () => {
    chosen = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark';
    try { localStorage.setItem('hhtdae-theme', chosen); } catch (e) { /* as above */ }
    setTheme(chosen);
  };
}

/* ---- keys, buttons, pointers ---- */

function press(id, on) { element(id).setAttribute('aria-pressed', String(on)); }

/* Fits the view; in a narrow view the labels at the top must not cover the model. */
function fit() {
  if (!view) return;
  view.resize();
  view.fit(run.surfaces.length && view.canvas.clientWidth < 600 ? 0.25 : 0);
  change();
}

function setFollow(on) {
  state.follow = on;
  press('follow', on);
  change();
}

const turn = (...angles) => () => { if (view) view.turn(...angles); };

const actions = {
  play: () => play(!state.playing),
  slower: () => changeSpeed(false),
  faster: () => changeSpeed(true),
  fit,
  follow: () => setFollow(!state.follow && state.body >= 0),
  joints: () => {
    if (!model || !view) return;
    const on = element('joints').getAttribute('aria-pressed') !== 'true';
    for (const s of model.symbols) s.visible = on;
    press('joints', on);
    change();
  },
  help: () => element('about').showModal(),
};

const keys = {
  ' ': 'play', ArrowUp: 'faster', ArrowDown: 'slower', f: 'fit', l: 'follow', j: 'joints', t: 'theme', '?': 'help',
  ArrowLeft: e => goFrames(e.shiftKey ? -10 : -1), ArrowRight: e => goFrames(e.shiftKey ? 10 : 1), Home: () => scrubTo(begin()), End: () => scrubTo(end()),
  a: turn(-0.1, 0), d: turn(0.1, 0), w: turn(0, -0.1), s: turn(0, 0.1),
};

function onKey(e) {
  if (e.ctrlKey || e.metaKey || e.altKey || element('about').open || /^(INPUT|SELECT)$/.test(e.target.tagName) && e.target.type !== 'range') return;
  if (e.key === ' ' && e.target.tagName === 'BUTTON' || e.target.tagName === 'SUMMARY') return; /* the space bar activates the button */
  if (e.target.id === 'deflection' && /^(Arrow|Home|End)/.test(e.key)) return;
  if (e.target.closest('aside') && /^(ArrowUp|ArrowDown|Home|End)$/.test(e.key)) return; /* these keys scroll the lists */
  const action = keys[e.key.length === 1 ? e.key.toLowerCase() : e.key];
  if (!action) return;
  e.preventDefault();
  typeof action === 'string' ? actions[action]() : action(e);
}

function prepareControls() {
  for (const id of ['play', 'slower', 'faster', 'fit', 'follow', 'joints', 'theme', 'help']) element(id).addEventListener('click', () => actions[id]());
  element('scrub').max = 1e4;
  element('scrub').addEventListener('input', e => scrubTo(begin() + (end() - begin()) * e.target.value / 1e4));
  document.addEventListener('keydown', onKey);
  new ResizeObserver(() => { if (view && view.fitted) fit(); else if (view) view.resize(); draw(); }).observe(element('view'));
  new ResizeObserver(change).observe(element('plots'));
  if (!view) return;
  let down = null;
  element('canvas').addEventListener('pointerdown', e => { down = e.isPrimary ? [e.clientX, e.clientY] : null; }); // a second finger: pinch
  element('canvas').addEventListener('pointercancel', () => { down = null; });
  element('canvas').addEventListener('pointerup', e => {
    if (!down || Math.hypot(e.clientX - down[0], e.clientY - down[1]) > 5 || e.button) return;
    const hit = view.pick(e.clientX, e.clientY);
    select(hit ? hit.body : -1, hit && hit.surface ? hit : null, hit && hit.element ? hit : null);
  });
}

/* ---- self-test of the page, with #selftest appended to its address ---- */

const frames = n => new Promise(done => { const next = () => n-- > 0 ? nextPicture(next) : done(); next(); });

/* Steps through the run, plays it, selects objects; writes the results to an attribute of the document */
async function testSelf() {
  nextPicture = f => setTimeout(() => f(performance.now()), 16); /* a browser without a screen may not call requestAnimationFrame() callbacks */
  const result = {frames: run.time.length, bodies: run.scene.bodies.length, channels: run.scene.channels.length, surfaces: run.surfaces.length, webgl: !!view};
  const n = run.time.length;
  for (let k = 0; k < n; k += Math.max(1, Math.floor(n / 12))) {
    scrubTo(run.time[k]);
    await frames(2);
  }
  if (view) {
    result.drawn = view.renderer.info.render.triangles;
    result.visible = model.bodies.filter(g => g.visible).length;
    const pixels = new Uint8Array(4 * 64 * 64), gl = view.renderer.getContext(), box = view.renderer.getDrawingBufferSize(new THREE.Vector2());
    view.draw();
    gl.readPixels(box.x / 2 - 32, box.y / 2 - 32, 64, 64, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    result.colours = new Set(new Uint32Array(pixels.buffer)).size;
  }
  if (n) {
    result.first = Array.from(run.frame[0].slice(0, 7));
    result.last = Array.from(run.frame[n - 1].slice(0, 7));
    if (result.bodies) select(0);
    if (result.channels) toggleChannel(result.channels - 1);
  }
  scrubTo(begin());
  play(true);
  const from = state.t;
  for (let waited = 0; waited < 100 && !(state.t > from); waited++) await frames(1); // time may not advance in the first frames
  result.played = state.t > from;
  play(false);
  result.plots = document.querySelectorAll('.plot').length;
  result.errors = pageErrors;
  document.documentElement.dataset.selftest = JSON.stringify(result);
}

/* ---- start ---- */

/* Applies settings appended to the address, for making pictures: #time=0.5&theme=dark&body=2&deflection=60&play */
function applyAddress() {
  const set = new URLSearchParams(location.hash.slice(1));
  if (set.has('theme')) setTheme(set.get('theme') === 'dark' ? 'dark' : 'light');
  if (set.has('time')) go(Number(set.get('time')) || 0);
  if (set.has('body')) select(Math.min(run.scene.bodies.length - 1, Number(set.get('body')) || 0));
  if (set.has('deflection') && run.surfaces.length) {
    element('deflection').value = set.get('deflection');
    setDeflection();
  }
  if (set.has('play')) play(true);
  return set.has('selftest');
}

async function start() {
  actions.theme = prepareTheme();
  if (typeof DecompressionStream === 'undefined') {
    say('This browser is too old for the page: it needs DecompressionStream (Chromium 80, Firefox 113, Safari 16.4).', true);
    return;
  }
  try {
    run = await readRun(part => say(`Reading the run … ${Math.round(100 * part)} %`));
  } catch (e) {
    say('The data of this page cannot be read: ' + e.message, true);
    throw e;
  }
  document.title = element('title').textContent = run.scene.title;
  try {
    model = new Model(run);
    view = new View(model, element('canvas'), change);
  } catch (e) {
    if (!/WebGL/i.test(e.message)) throw e;
    view = null;
  }
  if (!run.time.length) say('The run has no frames yet. ' + run.notice, true);
  else say(view ? '' : 'This browser shows no WebGL: there are plots, but no picture. ' + run.notice, !view);
  state.speed = naturalSpeed();
  state.t = begin();
  showSpeed();
  prepareControls();
  setTheme(document.documentElement.dataset.theme);
  addLists();
  if (view) {
    fit();
    element('grid-note').textContent = 'grid ' + formatNumber(view.gridStep, 2) + (run.notice ? ' · ' + run.notice : '');
    prepareSurfaces();
  }
  for (let c = 0; c < Math.min(2, run.scene.channels.length); c++) toggleChannel(c);
  if (!run.scene.channels.length && run.scene.bodies.length && run.time.length) select(run.scene.bodies.length - 1);
  if (applyAddress()) {
    asked = false;
    await testSelf();
  }
}

document.addEventListener('DOMContentLoaded', start); /* the data follow this program in the page */
