/* Geometries of shapes, joints and springs. Lengths are in the unit of the scene; `size` is the extent of the scene at its first frame. */

const bodyColours = ['#4e79a7', '#f28e2b', '#59a14f', '#b07aa1', '#e15759', '#3fa7a3', '#d4a72c', '#9c755f', '#e377a2', '#7f9b4a'];

const zUp = geometry => geometry.rotateX(Math.PI / 2); /* in three.js the axes of cylinders are along y */

/* Equal shapes share a geometry, since a scene may have thousands of them. */
const made = new Map();
function once(key, make) {
  if (!made.has(key)) made.set(key, make());
  return made.get(key);
}

const edgesOf = geometry => once('edges ' + geometry.id, () => new THREE.EdgesGeometry(geometry, 30));
const rod = radius => once('rod ' + radius, () => new THREE.CylinderBufferGeometry(radius, radius, 1, 12)); /* a cylinder of length one along y */

function shapeGeometry(shape, guess, reach) {
  let [a, b, c] = shape.size;
  if (guess) [a, b, c] = shape.size.map(x => Math.min(Math.max(x, 0.08 * reach), reach));
  return once([shape.kind, a, b, c].join(), () => {
    if (shape.kind === 'box') return new THREE.BoxBufferGeometry(2 * a, 2 * b, 2 * c);
    if (shape.kind === 'cylinder') return zUp(new THREE.CylinderBufferGeometry(a, a, 2 * c, 40));
    return new THREE.SphereBufferGeometry(1, 36, 24).scale(a, b, c);
  });
}

/* A coil of length one along y */
function coilGeometry(radius, length) {
  const turns = 9, wire = 0.16 * radius;
  class Coil extends THREE.Curve {
    getPoint(s) {
      const u = Math.min(1, Math.max(0, (s - 0.1) / 0.8)), r = radius * Math.min(1, 12 * Math.min(u, 1 - u)), a = 2 * Math.PI * turns * u;
      return new THREE.Vector3(r * Math.cos(a), (s - 0.5) * length, r * Math.sin(a));
    }
  }
  return new THREE.TubeBufferGeometry(new Coil(), 24 * turns, wire, 6).scale(1, 1 / length, 1);
}

/* The symbol of a joint, with z along the z axis of its marker; null if the type has no symbol */
function jointGeometry(type, s) {
  if (/revolute|cylindrical|screw/.test(type)) return once('pin', () => zUp(new THREE.CylinderBufferGeometry(0.75 * s, 0.75 * s, 2.6 * s, 24)));
  if (/spherical|universal|constant velocity/.test(type)) return once('ball', () => new THREE.SphereBufferGeometry(s, 24, 16));
  if (/translational/.test(type)) return once('slide', () => new THREE.BoxBufferGeometry(1.3 * s, 1.3 * s, 3 * s));
  return null;
}

/* Splits nodes on edges of a surface into several vertices, one for each side, so that edges are shaded sharply: faces at
   a node share a vertex if their normals are within 60 degrees. Returns the node of every vertex, and the vertices of the
   triangles. */
function splitAtCreases(s) {
  const faces = s.triangle.length / 3, normal = new Float32Array(s.triangle.length), share = 0.5;
  const [a, b, c] = [0, 1, 2].map(() => new THREE.Vector3());
  for (let f = 0; f < faces; f++) {
    [a, b, c].forEach((p, k) => p.fromArray(s.point, 3 * s.triangle[3 * f + k]));
    b.sub(a).cross(c.sub(a)).normalize().toArray(normal, 3 * f);
  }
  const node = [], index = new Uint32Array(s.triangle.length), sides = Array.from({length: s.nodes}, () => []);
  for (let k = 0; k < index.length; k++) {
    const at = 3 * Math.floor(k / 3), list = sides[s.triangle[k]];
    let side = list.find(v => v.n[0] * normal[at] + v.n[1] * normal[at + 1] + v.n[2] * normal[at + 2] > share);
    if (!side) {
      side = {vertex: node.length, n: normal.subarray(at, at + 3)};
      list.push(side);
      node.push(s.triangle[k]);
    }
    index[k] = side.vertex;
  }
  return {node: Uint32Array.from(node), index};
}

/* Colours of stress, as fractions of the largest one shown */
const stressStops = [[0, '#30408f'], [0.15, '#3f7fd6'], [0.32, '#35b6c9'], [0.5, '#58c865'], [0.68, '#d8d62f'], [0.84, '#f28a22'], [1, '#c5141d']];
const stressTable = (() => {
  const table = [], a = new THREE.Color();
  for (let i = 0; i < 256; i++) {
    const x = i / 255, k = Math.max(1, stressStops.findIndex(s => s[0] >= x)), [x0, c0] = stressStops[k - 1], [x1, c1] = stressStops[k];
    a.set(c0).lerp(new THREE.Color(c1), (x - x0) / (x1 - x0));
    table.push([a.r, a.g, a.b]);
  }
  return table;
})();
