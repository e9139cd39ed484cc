/* Put into a page by page.py: what its test of itself leaves open. Each check answers with what it found, in an attribute of the document. */

const pageChecks = {
  /* Calls of lineTo() for ten pictures of a plot of 1e5 samples, after its first one, and for that one; which must show the one sample that sticks out */
  curves() {
    const n = 1e5, time = Float64Array.from({length: n}, (x, k) => k / n), value = time.map(t => Math.sin(5000 * t));
    value[40000] = 9;
    const plot = new Plot(time, 'many', 'N', [{name: '', value}], () => {}), line = CanvasRenderingContext2D.prototype.lineTo;
    element('plots').append(plot.element);
    let count = 0;
    CanvasRenderingContext2D.prototype.lineTo = function (x, y) {
      count++;
      line.call(this, x, y);
    };
    plot.draw(0.5, [n / 2, 0]);
    const first = count;
    for (let k = 0; k < 10; k++) plot.draw(0.1 * k, [n / 10 * k, 0]);
    CanvasRenderingContext2D.prototype.lineTo = line;
    const ratio = window.devicePixelRatio || 1, [x, y] = [plot.x(0.4), plot.y(8)].map(p => Math.round(ratio * p));
    const pixels = plot.canvas.getContext('2d').getImageData(x - 2, y, 5, 1).data;
    plot.element.remove();
    return {first, later: count - first, peak: pixels.some((c, k) => k % 4 === 3 && c > 100)};
  },

  /* Texts of the time display for a run as it is, for one of nanoseconds, for one that begins late, and for a single frame */
  times() {
    const own = [run.time, state.t], texts = [];
    const show = time => {
      run.time = time;
      state.t = time[time.length - 1];
      draw();
      texts.push(element('time').textContent);
    };
    show([0, 1, 2]);
    show([0, 5e-16, 1e-15]);
    show([1000, 1000.5, 1001]);
    show([0.25]);
    [run.time, state.t] = own;
    draw();
    return texts;
  },

  /* Bodies selected by a click in the middle of the picture, by the finger of a pinch that rests, by a touch that the browser takes over */
  touch() {
    const canvas = element('canvas'), box = canvas.getBoundingClientRect(), found = [], pick = view.pick;
    view.pick = () => ({body: 0});
    const send = (type, pointerId, isPrimary) => canvas.dispatchEvent(new PointerEvent(type, {pointerId, isPrimary, clientX: box.left + 200, clientY: box.top + 200, bubbles: true}));
    const attempt = (...events) => {
      select(-1);
      for (const e of events) send(...e);
      found.push(state.body);
    };
    attempt(['pointerdown', 7, true], ['pointerup', 7, true]);
    attempt(['pointerdown', 7, true], ['pointerdown', 8, false], ['pointerup', 8, false], ['pointerup', 7, true]);
    attempt(['pointerdown', 7, true], ['pointercancel', 7, true], ['pointerup', 7, true]);
    view.pick = pick;
    select(-1);
    return found;
  },

  /* Keys turn the view by 0.1 and keep its distance; in the lists those that scroll are left to the browser */
  keys() {
    const send = (key, to) => { const e = new KeyboardEvent('keydown', {key, bubbles: true, cancelable: true}); to.dispatchEvent(e); return e.defaultPrevented; };
    const from = () => view.camera.position.clone().sub(view.controls.target), before = from();
    send('d', element('canvas'));
    const beside = from();
    send('w', element('canvas'));
    const flat = d => d.clone().addScaledVector(view.up, -d.dot(view.up));
    return {
      turned: flat(before).angleTo(flat(beside)), raised: beside.angleTo(view.up) - from().angleTo(view.up), farther: from().length() / before.length() - 1,
      inList: send('ArrowDown', document.querySelector('#lists button')), elsewhere: send('Home', element('canvas')),
    };
  },

  /* "Follow" before a body is selected, then, and after */
  follow() {
    const found = [], button = element('follow'), keep = () => found.push([button.disabled, button.getAttribute('aria-pressed')].join());
    select(-1);
    actions.follow();
    keep();
    select(0);
    actions.follow();
    keep();
    select(-1);
    keep();
    return found;
  },

  notice: () => (view ? element('grid-note') : element('message')).textContent,

  /* How far attachments, and the symbol of a joint between the ground and the last of them, are from where the nearest node of the surface takes them, relative
     to the largest scaled displacement */
  deflection() {
    const s = run.surfaces[0], t = run.time[Math.floor(0.8 * run.time.length)], scale = 50, at = new THREE.Vector3();
    const attachments = run.scene.bodies.map((b, k) => k).filter(k => run.scene.bodies[k].carrier === s.body);
    run.scene.elements.push({name: '', type: 'revolute', kind: 'joint', i: [-1, 0, 0, 0, 0, 0, 0, 1], j: [attachments[attachments.length - 1], 0, 0, 0, 0, 0, 0, 1]});
    model = new Model(run);
    const node = (k, p) => p.fromArray(s.now, 3 * k).applyMatrix4(model.bodies[s.body].matrixWorld);
    const symbol = model.symbols.filter(m => attachments.includes(m.parent.userData.body));
    const places = () => [...attachments.map(k => model.bodies[k]), ...symbol].map(o => o.getWorldPosition(new THREE.Vector3()));
    const look = deflection => {
      model.moveTo(t, deflection);
      model.scene3.updateMatrixWorld(true);
    };
    look(1);
    const before = places(), nearest = before.map(p => {
      let best = 0, least = Infinity;
      for (let k = 0; k < s.nodes; k++) if (node(k, at).distanceTo(p) < least) [best, least] = [k, at.distanceTo(p)];
      return best;
    });
    const nodes = nearest.map(k => node(k, new THREE.Vector3()).clone());
    look(scale);
    let worst = 0, largest = 0;
    places().forEach((p, i) => {
      const moved = node(nearest[i], new THREE.Vector3()).sub(nodes[i]);
      largest = Math.max(largest, moved.length());
      worst = Math.max(worst, p.sub(before[i]).sub(moved).length());
    });
    look(1);
    return {worst: worst / largest, places: before.length, symbols: symbol.length};
  },

  /* The same surface with its stress in another unit: the same colours, and a legend of its own */
  units() {
    const s = run.surfaces[0], other = {...s, unit: 'MPa', field: s.field.map(f => ({largest: f.largest.map(x => 1e-6 * x), code: f.code}))};
    run.surfaces = [s, other];
    model = new Model(run);
    prepareSurfaces();
    model.moveTo(run.time[run.time.length >> 1], 1);
    const colour = run.surfaces.map(x => x.mesh.geometry.attributes.color.array);
    let apart = 0;
    colour[0].forEach((c, k) => { apart = Math.max(apart, Math.abs(c - colour[1][k])); });
    return {apart, colours: new Set(colour[0]).size, legends: [...document.querySelectorAll('#legend > div')].map(l => l.textContent)};
  },
};

document.addEventListener('DOMContentLoaded', async () => {
  while (!document.documentElement.dataset.selftest) await new Promise(done => setTimeout(done, 50));
  const found = {};
  for (const name of wantedChecks) {
    try {
      found[name] = pageChecks[name]();
    } catch (e) {
      found[name] = String(e.stack);
    }
  }
  document.documentElement.dataset.checks = JSON.stringify(found);
});
