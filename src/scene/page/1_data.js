/* Reads the page's data: script elements in base64 of zlib's deflate, in the formats described in
   src/scene/output/page_frames.h and page_surface.h. */

async function unpack(element) {
  const text = atob(element.textContent.trim()), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  element.textContent = ''; /* frees the text, which is no longer needed */
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Reader(await new Response(stream).arrayBuffer());
}

class Reader {
  constructor(buffer) {
    this.bytes = new Uint8Array(buffer);
    this.view = new DataView(buffer);
    this.at = 0;
  }
  u32() { this.at += 4; return this.view.getUint32(this.at - 4, true); }
  f32() { this.at += 4; return this.view.getFloat32(this.at - 4, true); }
  f64() { this.at += 8; return this.view.getFloat64(this.at - 8, true); }
  u8s(n) { this.at += n; return this.bytes.subarray(this.at - n, this.at); }
  /* n numbers in planes: bytes of the same significance are stored together */
  u16s(n) {
    const x = new Uint16Array(n), b = this.u8s(2 * n);
    for (let i = 0; i < n; i++) x[i] = b[i] | b[n + i] << 8;
    return x;
  }
  u32s(n) {
    const x = new Uint32Array(n), b = this.u8s(4 * n);
    for (let i = 0; i < n; i++) x[i] = (b[i] | b[n + i] << 8 | b[2 * n + i] << 16 | b[3 * n + i] << 24) >>> 0;
    return x;
  }
  f32s(n) { return new Float32Array(this.u32s(n).buffer); }
}

const fromZigZag = x => x >>> 1 ^ -(x & 1);

function readSurface(r) {
  const nodes = r.u32(), triangles = r.u32(), modes = r.u32();
  const s = {nodes, point: r.f32s(3 * nodes), triangle: r.u32s(3 * triangles), mode: []};
  const step = [];
  for (let k = 0; k < modes; k++) step.push(r.f32());
  const code = r.u16s(3 * nodes * modes);
  for (let k = 0, at = 0; k < modes; k++) {
    const shape = new Float32Array(3 * nodes);
    let largest = 0;
    for (let c = 0; c < 3; c++)
      for (let i = 0; i < nodes; i++) {
        const x = step[k] * fromZigZag(code[at++]);
        shape[3 * i + c] = x;
        largest = Math.max(largest, Math.abs(x));
      }
    s.mode.push({shape, largest});
  }
  return s;
}

/* Displacements of nodes that move individually, in the axes of their body; displacement = step * code, with a step for each frame */
function readMotion(r, s, n) {
  const step = r.f32(), code = r.u16s(3 * s.nodes * n), frames = [];
  for (let i = 0; i < n; i++) frames.push({step, code: new Int16Array(3 * s.nodes), largest: 0});
  for (let k = 0, at = 0; k < 3 * s.nodes; k++)
    for (let i = 0, c = 0; i < n; i++) {
      c = c + fromZigZag(code[at++]) << 16 >> 16;
      frames[i].code[k] = c;
      frames[i].largest = Math.max(frames[i].largest, step * Math.abs(c));
    }
  s.motion.push(...frames);
}

/* Appends all frames of a block to the run */
function readFrames(r, run) {
  const n = r.u32(), tracks = run.tracks, first = run.time.length;
  for (let i = 0; i < n; i++) run.time.push(r.f64());
  const range = [];
  for (let k = 0; k < tracks; k++) range.push([r.f64(), r.f64()]);
  const code = r.u16s(n * tracks), value = new Float64Array(n * tracks);
  for (let k = 0, at = 0; k < tracks; k++)
    for (let i = 0, c = 0; i < n; i++) {
      c = c + fromZigZag(code[at++]) & 0xffff;
      value[i * tracks + k] = c === 65535 ? NaN : range[k][0] + range[k][1] * c;
    }
  for (let i = 0; i < n; i++) run.frame.push(value.subarray(i * tracks, (i + 1) * tracks));
  for (const channel of run.scene.channels) channel.value = channel.value || [];
  const bits = r.f32s(n * run.scene.channels.length);
  run.scene.channels.forEach((channel, c) => { for (let i = 0; i < n; i++) channel.value.push(bits[c * n + i]); });
  for (const s of run.surfaces) {
    if (s.moving) readMotion(r, s, n);
    if (!s.stress) continue;
    const largest = r.f32s(s.nodes), code = r.u8s(n * s.nodes), field = [];
    for (let i = 0; i < n; i++) field.push(new Uint8Array(s.nodes));
    for (let k = 0, at = 0; k < s.nodes; k++)
      for (let i = 0, c = 0; i < n; i++) field[i][k] = c = c + code[at++] & 255;
    for (let i = 0; i < n; i++) s.field.push({largest, code: field[i]});
  }
  if (first && run.time[first] < run.time[first - 1]) console.error('times go backwards at frame ' + first);
}

/*
  The run: scene (its description), time (of the frames), frame (the tracks of each frame: 7 numbers per body, then modal coordinates), surfaces.
  If writing the page was interrupted in the middle of a block, this last block cannot be unpacked: it is left out, and a notice says so.
*/
async function readRun(progress) {
  const scene = JSON.parse(document.getElementById('scene').textContent);
  const run = {scene, time: [], frame: [], surfaces: [], tracks: 7 * scene.bodies.length, notice: ''};
  for (const b of scene.bodies) {
    b.modal = run.tracks;
    run.tracks += b.modes;
  }
  const elements = [...document.querySelectorAll('script[data-kind]')];
  let surface = 0;
  for (let k = 0; k < elements.length; k++) {
    progress(k / elements.length);
    try {
      const r = await unpack(elements[k]);
      if (elements[k].dataset.kind === 'surface') run.surfaces.push({...scene.surfaces[surface++], field: [], motion: [], ...readSurface(r)});
      else readFrames(r, run);
    } catch (e) {
      if (k + 1 < elements.length || elements[k].dataset.kind === 'surface') throw e;
      run.notice = 'The page was cut off while it was written: the end of the run is missing.';
    }
  }
  return run;
}

/* The number of the frame before time t, and the fraction of the way from it to the next frame, 0 to 1 */
function placeInTime(run, t) {
  const time = run.time, n = time.length;
  if (n < 2 || !(t > time[0])) return [0, 0];
  if (t >= time[n - 1]) return [n - 1, 0];
  let low = 0, high = n - 1;
  while (high - low > 1) {
    const middle = low + high >> 1;
    if (time[middle] <= t) low = middle;
    else high = middle;
  }
  return [low, (t - time[low]) / (time[high] - time[low])];
}

/* Tracks at time t: positions and modal coordinates are interpolated linearly, quaternions along the shorter of the two arcs */
function framesAt(run, t) {
  const [k, s] = placeInTime(run, t), a = run.frame[k];
  if (!a || s === 0) return a;
  const b = run.frame[k + 1], x = new Float64Array(run.tracks);
  for (let i = 0; i < run.tracks; i++) x[i] = a[i] + s * (b[i] - a[i]);
  for (let q = 3; q < 7 * run.scene.bodies.length; q += 7) {
    let dot = 0, norm = 0;
    for (let i = q; i < q + 4; i++) dot += a[i] * b[i];
    for (let i = q; i < q + 4; i++) {
      x[i] = a[i] * (1 - s) + (dot < 0 ? -s : s) * b[i];
      norm += x[i] * x[i];
    }
    norm = Math.sqrt(norm) || 1;
    for (let i = q; i < q + 4; i++) x[i] /= norm;
  }
  return x;
}

/* The von Mises stress at a node at time t */
function stressAt(surface, run, node, t) {
  const [k, s] = placeInTime(run, t), at = f => f.largest[node] * f.code[node] / 255;
  const a = surface.field[k], b = surface.field[Math.min(k + 1, surface.field.length - 1)];
  return a ? at(a) * (1 - s) + at(b) * s : NaN;
}
