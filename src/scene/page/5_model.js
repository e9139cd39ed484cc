/* The scene in three dimensions. It is built once from the description, then moved to the time shown. */

class Model {
  constructor(run) {
    this.run = run;
    this.scene3 = new THREE.Scene();
    this.bodies = run.scene.bodies.map((body, k) => {
      const group = new THREE.Group();
      group.userData.body = k;
      this.scene3.add(group);
      return group;
    });
    this.ground = new THREE.Group();
    this.scene3.add(this.ground);
    this.symbols = []; /* symbols of joints */
    this.spans = [];   /* meshes that extend from place a to place b: {a, b, mesh} */
    this.deflection = 1;
    this.hasSurface = this.bodies.map((g, k) => run.surfaces.some(s => s.body === k));
    this.first = run.frame.length ? run.frame.find(f => f.slice(0, 7 * this.bodies.length).every(Number.isFinite)) || run.frame[0] : null;
    this.findPlaces();
    this.findOrigin();
    this.size = this.extentAtStart();
    this.addLights();
    this.addBodies();
    this.addLines();
    this.addElements();
    this.addSurfaces();
    this.findBounds();
  }

  /* ---- places ---- */

  /* Coordinates are drawn relative to the first body: graphics use single precision, in which positions far from the origin would jitter. */
  findOrigin() {
    const b = this.bodies.length && this.first ? this.first : null;
    this.origin = b ? [b[0], b[1], b[2]] : [0, 0, 0];
    if (!this.origin.every(Number.isFinite) || Math.hypot(...this.origin) < 1e4) this.origin = [0, 0, 0];
    this.ground.position.set(-this.origin[0], -this.origin[1], -this.origin[2]);
  }

  pose(tracks, body, position, rotation) {
    if (body < 0) {
      position.copy(this.ground.position);
      rotation.set(0, 0, 0, 1);
      return true;
    }
    const x = tracks, k = 7 * body;
    position.set(x[k] - this.origin[0], x[k + 1] - this.origin[1], x[k + 2] - this.origin[2]);
    rotation.set(x[k + 3], x[k + 4], x[k + 5], x[k + 6]);
    if (this.deflection !== 1 && this.onSurface(body)) this.scaleDeflection(tracks, this.run.scene.bodies[body], position);
    return Number.isFinite(position.x + position.y + position.z + rotation.x + rotation.y + rotation.z + rotation.w);
  }

  /* Scales the displacement of an attachment's frame by the same factor as those of its body's surface. */
  scaleDeflection(tracks, frame, position) {
    const rest = this.pointAt(tracks, [frame.carrier, ...frame.rest]);
    position.sub(rest).multiplyScalar(this.deflection).add(rest);
  }

  pointAt(tracks, place, to = new THREE.Vector3()) {
    const position = new THREE.Vector3(), rotation = new THREE.Quaternion();
    this.pose(tracks, place[0], position, rotation);
    return to.set(place[1], place[2], place[3]).applyQuaternion(rotation).add(position);
  }

  /* Whether the body is the frame of an attachment of a flexible body whose surface is drawn */
  onSurface(body) { return body >= 0 && !!this.hasSurface[this.run.scene.bodies[body].carrier]; }

  /* Collects the places of markers of joints, forces and lines (places), those on each body (placesOf), and the frames of
     attachments of each flexible body */
  findPlaces() {
    this.places = [];
    for (const e of this.run.scene.elements) for (const p of [e.i, e.j]) if (p) this.places.push(p);
    for (const line of this.run.scene.lines) this.places.push(...line.filter(Boolean));
    this.placesOf = this.bodies.map(() => []);
    for (const p of this.places) if (p[0] >= 0) this.placesOf[p[0]].push(p);
    this.framesOf = this.bodies.map(() => []);
    this.run.scene.bodies.forEach((b, k) => { if (b.carrier >= 0) this.framesOf[b.carrier].push(k); });
  }

  extentAtStart() {
    if (!this.first) return 1;
    const box = new THREE.Box3();
    const add = p => { if (Number.isFinite(p.x + p.y + p.z)) box.expandByPoint(p); };
    this.bodies.forEach((g, b) => add(this.pointAt(this.first, [b, 0, 0, 0])));
    for (const p of this.places) add(this.pointAt(this.first, p));
    for (const body of this.run.scene.bodies) if (!body.guess) for (const s of body.shapes) for (const d of [-1, 1]) add(this.pointAt(this.first, [s.at[0], s.at[1] + d * s.size[0], s.at[2] + d * s.size[1], s.at[3] + d * s.size[2]]));
    for (const s of this.run.surfaces) if (s.moving) for (let k = 0; k < s.point.length; k += 3) add(this.pointAt(this.first, [s.body, ...s.point.slice(k, k + 3)]));
    const size = box.isEmpty() ? 0 : box.getSize(new THREE.Vector3()).length();
    return size > 0 ? size : 1;
  }

  /* ---- parts ---- */

  addLights() {
    const up = new THREE.Vector3(...this.run.scene.up);
    this.sky = new THREE.HemisphereLight(0xffffff, 0x8891a0, 0.66);
    this.sky.position.copy(up);
    this.sun = new THREE.DirectionalLight(0xffffff, 0.5);
    this.scene3.add(this.sky, this.sun, this.sun.target);
  }

  material(colour, more = {}) { return new THREE.MeshPhongMaterial({color: colour, specular: 0x1c1c1c, shininess: 35, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1, ...more}); }
  colourOf(body) { return body < 0 ? '#8a94a3' : bodyColours[this.colourIndex[body] % bodyColours.length]; }

  mesh(parent, geometry, material, place) {
    const mesh = new THREE.Mesh(geometry, material);
    mesh.castShadow = mesh.receiveShadow = true;
    if (place) {
      mesh.position.set(place[1], place[2], place[3]);
      mesh.quaternion.set(place[4], place[5], place[6], place[7]);
    }
    parent.add(mesh);
    return mesh;
  }

  /* Distance of the farthest marker from the centre of mass, which limits the size of shapes derived from the inertia */
  reachOf(body) {
    let reach = 0;
    for (const p of this.placesOf[body]) reach = Math.max(reach, Math.hypot(p[1], p[2], p[3]));
    return reach > 0 ? Math.max(reach, 0.02 * this.size) : 0.05 * this.size;
  }

  addBodies() {
    let next = 0;
    this.colourIndex = this.run.scene.bodies.map(b => b.carrier < 0 ? next++ : 0);
    this.run.scene.bodies.forEach((b, k) => { if (b.carrier >= 0) this.colourIndex[k] = this.colourIndex[b.carrier]; });
    this.materials = this.bodies.map((g, k) => this.material(this.colourOf(k)));
    const edge = new THREE.LineBasicMaterial({color: 0x000000, transparent: true, opacity: 0.28});
    const draw = (group, shapes, material, guess, reach) => {
      for (const s of shapes) {
        const mesh = this.mesh(group, shapeGeometry(s, guess, reach), s.colour < 0 ? material : this.material(s.colour), s.at);
        if (s.kind !== 'sphere') mesh.add(new THREE.LineSegments(edgesOf(mesh.geometry), edge));
      }
    };
    this.run.scene.bodies.forEach((b, k) => {
      const reach = this.reachOf(k);
      draw(this.bodies[k], b.shapes, this.materials[k], b.guess, reach);
      if (b.guess && b.carrier < 0) this.addBars(b, k, reach);
    });
    draw(this.ground, this.run.scene.ground, this.material(this.colourOf(-1)), false, 1);
  }

  /* Adds bars from the centre of mass to the markers of a body of unknown shape; for a flexible body to its attachments, which move with its modes */
  addBars(b, k, reach) {
    const radius = 0.006 * this.size, seen = new Set();
    if (!b.shapes.length && !b.modes) this.mesh(this.bodies[k], once('dot', () => new THREE.SphereBufferGeometry(0.014 * this.size, 24, 16)), this.materials[k]);
    for (const p of this.placesOf[k]) {
      const key = p.slice(1, 4).map(x => x.toFixed(6)).join();
      if (seen.has(key) || Math.hypot(p[1], p[2], p[3]) < 1e-3 * this.size) continue;
      seen.add(key);
      this.addSpan([k, 0, 0, 0], p, rod(radius), this.materials[k], k);
    }
    for (const c of this.framesOf[k]) this.addSpan([k, 0, 0, 0], [c, 0, 0, 0], rod(radius), this.materials[k], k);
  }

  /* Adds a mesh from place a to place b; its geometry has length one along y. If both places are on one body, the mesh is fixed to that body */
  addSpan(a, b, geometry, material, body) {
    const fixed = a[0] === b[0], parent = !fixed ? this.scene3 : a[0] < 0 ? this.ground : this.bodies[a[0]];
    const mesh = this.mesh(parent, geometry, material);
    mesh.userData.body = body;
    if (fixed) this.stretch(mesh, new THREE.Vector3(a[1], a[2], a[3]), new THREE.Vector3(b[1], b[2], b[3]));
    else this.spans.push({a, b, mesh});
    return mesh;
  }

  stretch(mesh, a, b) {
    const along = b.clone().sub(a), length = along.length();
    mesh.visible = length > 0 && Number.isFinite(length);
    if (!mesh.visible) return;
    mesh.position.copy(a).add(b).multiplyScalar(0.5);
    mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.divideScalar(length));
    mesh.scale.set(1, length, 1);
  }

  addLines() {
    const radius = 0.0045 * this.size;
    for (const line of this.run.scene.lines)
      for (let k = 0; k + 1 < line.length; k++) {
        if (!line[k] || !line[k + 1]) continue;
        const one = line[k][0] === line[k + 1][0], body = line[k][0];
        this.addSpan(line[k], line[k + 1], rod(radius), one && body >= 0 ? this.materials[body] : this.material('#6b7585'), body);
      }
  }

  addElements() {
    const s = 0.012 * this.size, metal = this.material('#5b6472'), spring = this.material('#7d8898'), joint = this.material('#4a5361');
    /* also visible behind other objects */
    const hidden = new THREE.MeshBasicMaterial({color: 0xffffff, transparent: true, opacity: 0.13, depthTest: false});
    const few = this.run.scene.elements.length < 200; /* many overlapping ones would hide everything else */
    for (const e of this.run.scene.elements) {
      if (!e.i) continue;
      const geometry = e.kind === 'joint' ? jointGeometry(e.type, s) : null;
      if (geometry) {
        /* on the surface, whose scaled deflections would otherwise separate it from the joint */
        const place = e.j && this.onSurface(e.j[0]) && !this.onSurface(e.i[0]) ? e.j : e.i;
        const mesh = this.mesh(place[0] < 0 ? this.ground : this.bodies[place[0]], geometry, joint, place);
        mesh.userData.element = `${e.name} (${e.type})`;
        if (few) {
          const ghost = new THREE.Mesh(geometry, hidden);
          ghost.renderOrder = 1;
          ghost.userData.ghost = true;
          mesh.add(ghost);
        }
        this.symbols.push(mesh);
      }
      if (!e.j || e.i[0] === e.j[0]) continue;
      const add = (geometry, material) => { this.addSpan(e.i, e.j, geometry, material, -1).userData.element = `${e.name} (${e.type})`; };
      const length = this.first ? this.pointAt(this.first, e.i).distanceTo(this.pointAt(this.first, e.j)) : 0;
      if (/^(spring-damper|nonlinear spring)$/.test(e.type) && length > 0.01 * this.size) add(coilGeometry(Math.min(0.018 * this.size, 0.16 * length), length), spring);
      else if (/^beam$/.test(e.type)) add(rod(0.007 * this.size), metal);
      else if (/distance/.test(e.type)) add(rod(0.004 * this.size), metal);
    }
  }

  addSurfaces() {
    for (const s of this.run.surfaces) {
      const geometry = new THREE.BufferGeometry(), {node, index} = splitAtCreases(s);
      s.node = node;
      s.now = new Float32Array(3 * s.nodes); /* positions of the nodes */
      geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(3 * node.length), 3));
      geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(3 * node.length).fill(1), 3));
      geometry.setIndex(new THREE.BufferAttribute(index, 1));
      const material = this.material(this.colourOf(s.body), {side: THREE.DoubleSide, vertexColors: THREE.VertexColors});
      s.mesh = this.mesh(this.bodies[s.body], geometry, material);
      s.mesh.frustumCulled = false; /* its bounding volume changes with the deformation */
      s.active = s.mode.map((m, k) => k).filter(k => s.mode[k].largest > 0);
    }
    this.addScales();
    this.colourBy = this.scales.length ? 'stress' : 'body';
  }

  /* Makes the colour scales; surfaces whose stress has the same unit share one. */
  addScales() {
    this.scales = [];
    for (const s of this.run.surfaces) {
      if (!s.stress || !s.field.length) continue;
      s.scale = this.scales.find(c => c.unit === s.unit);
      if (!s.scale) this.scales.push(s.scale = {unit: s.unit, top: 0, largest: 0, surfaces: []});
      s.scale.surfaces.push(s);
      const {top, largest} = this.stressRange(s);
      s.scale.top = Math.max(s.scale.top, top);
      s.scale.largest = Math.max(s.scale.largest, largest);
    }
  }

  /* The largest stress of the run, and the stress that 99 % of the nodes never exceed. The colours end at the latter,
     since high values at a few nodes near attachments would give all other nodes the same colour. */
  stressRange(s) {
    const most = new Float32Array(s.nodes);
    for (const f of s.field) for (let i = 0; i < s.nodes; i++) if (f.code[i] === 255) most[i] = Math.max(most[i], f.largest[i]);
    const sorted = most.slice().sort();
    return {largest: sorted.length ? sorted[sorted.length - 1] : 0, top: sorted.length ? sorted[Math.floor(0.99 * (sorted.length - 1))] : 0};
  }

  /* ---- motion ---- */

  /* Moves everything to time t; deflection: factor of the displacements of surfaces and attachments */
  moveTo(t, deflection) {
    const tracks = framesAt(this.run, t);
    if (!tracks) return;
    this.deflection = deflection;
    this.bodies.forEach((g, k) => { g.visible = this.pose(tracks, k, g.position, g.quaternion); });
    for (const {a, b, mesh} of this.spans) this.stretch(mesh, this.pointAt(tracks, a), this.pointAt(tracks, b));
    for (const s of this.run.surfaces) {
      this.deform(s, tracks, t);
      this.paint(s, t);
    }
  }

  addModes(s, x, tracks) {
    const eta = this.run.scene.bodies[s.body].modal;
    for (const k of s.active) {
      const amount = this.deflection * tracks[eta + k], shape = s.mode[k].shape;
      if (!(Math.abs(amount) * s.mode[k].largest > 1e-7 * this.size)) continue;
      for (let i = 0; i < x.length; i++) x[i] += amount * shape[i];
    }
  }

  /* Adds displacements of nodes that move individually */
  addMotion(s, x, t) {
    const [k, part] = placeInTime(this.run, t), a = s.motion[k], b = s.motion[Math.min(k + 1, s.motion.length - 1)];
    if (!a) return;
    const fa = this.deflection * (1 - part) * a.step, fb = this.deflection * part * b.step;
    for (let i = 0; i < x.length; i++) x[i] += fa * a.code[i] + fb * b.code[i];
  }

  deform(s, tracks, t) {
    const position = s.mesh.geometry.attributes.position, to = position.array, x = s.now;
    x.set(s.point);
    if (s.moving) this.addMotion(s, x, t);
    else this.addModes(s, x, tracks);
    for (let v = 0; v < s.node.length; v++) {
      const i = 3 * s.node[v];
      to[3 * v] = x[i];
      to[3 * v + 1] = x[i + 1];
      to[3 * v + 2] = x[i + 2];
    }
    position.needsUpdate = true;
    /* normals of large meshes are computed only once, since they change little */
    if (!s.lit || s.triangle.length < 60000) s.mesh.geometry.computeVertexNormals();
    s.lit = true;
  }

  paint(s, t) {
    const attribute = s.mesh.geometry.attributes.color, c = attribute.array, by = s.scale ? this.colourBy : 'body';
    if (by === 'body') {
      if (s.painted !== by) c.fill(1);
      s.mesh.material.color.set(this.colourOf(s.body));
    } else {
      const [k, part] = placeInTime(this.run, t), a = s.field[k], b = s.field[Math.min(k + 1, s.field.length - 1)];
      const fa = (1 - part) / s.scale.top, fb = part / s.scale.top;
      for (let v = 0; v < s.node.length; v++) {
        const i = s.node[v], colour = stressTable[Math.min(255, Math.max(0, Math.round(fa * a.code[i] * a.largest[i] + fb * b.code[i] * b.largest[i]) || 0))];
        c[3 * v] = colour[0];
        c[3 * v + 1] = colour[1];
        c[3 * v + 2] = colour[2];
      }
      s.mesh.material.color.set(0xffffff);
    }
    if (by === 'stress' || s.painted !== by) attribute.needsUpdate = true;
    s.painted = by;
  }

  /* Finds the box around everything at some times of the run, and, for 100 directions spread evenly over the sphere, the
     outermost corner of any body: these points determine the view of a camera to 2 %, independently of the number of
     bodies */
  findBounds() {
    const n = this.run.frame.length, some = Math.min(n, 24), corner = new THREE.Vector3(), outermost = [];
    for (let k = 0; k < 100; k++) {
      const z = (2 * k + 1) / 100 - 1, turn = 2.399963 * k, r = Math.sqrt(1 - z * z); // the golden angle
      outermost.push({direction: new THREE.Vector3(r * Math.cos(turn), r * Math.sin(turn), z), most: -Infinity, point: new THREE.Vector3()});
    }
    this.bounds = new THREE.Box3();
    for (let k = 0; k < some; k++) {
      this.moveTo(this.run.time[some > 1 ? Math.round(k * (n - 1) / (some - 1)) : 0], 1);
      for (const s of this.run.surfaces) s.mesh.geometry.boundingBox = null;
      this.scene3.updateMatrixWorld(true);
      this.scene3.traverse(o => {
        if (!o.isMesh || !this.shown(o)) return;
        if (!o.geometry.boundingBox) o.geometry.computeBoundingBox();
        const {min, max} = o.geometry.boundingBox;
        for (let c = 0; c < 8; c++) {
          corner.set(c & 1 ? max.x : min.x, c & 2 ? max.y : min.y, c & 4 ? max.z : min.z).applyMatrix4(o.matrixWorld);
          if (!Number.isFinite(corner.x + corner.y + corner.z)) continue;
          this.bounds.expandByPoint(corner);
          for (const o of outermost) {
            const along = corner.dot(o.direction);
            if (along <= o.most) continue;
            o.most = along;
            o.point.copy(corner);
          }
        }
      });
    }
    this.points = outermost.filter(o => o.most > -Infinity).map(o => o.point);
    if (!this.points.length)
      for (const x of [-0.5, 0.5]) {
        this.points.push(new THREE.Vector3(x, x, x));
        this.bounds.expandByPoint(this.points[this.points.length - 1]);
      }
  }

  shown(o) {
    for (; o; o = o.parent) if (!o.visible) return false;
    return true;
  }

  /* The largest factor of displacements: it makes the largest displacement of the run a third of the scene's size */
  largestDeflection() {
    let most = 0;
    for (const s of this.run.surfaces) {
      const eta = this.run.scene.bodies[s.body].modal;
      for (const f of s.motion) most = Math.max(most, f.largest);
      for (const k of s.active) for (const f of this.run.frame) most = Math.max(most, Math.abs(f[eta + k]) * s.mode[k].largest || 0);
    }
    return most > 0 ? 0.33 * this.size / most : 1;
  }
}
