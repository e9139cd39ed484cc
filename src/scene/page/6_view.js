/* The view of the model: camera, ground grid, lights, picking. */

class View {
  constructor(model, canvas, changed) {
    this.model = model;
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true});
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 100);
    this.up = new THREE.Vector3(...model.run.scene.up);
    this.camera.up.copy(this.up);
    this.camera.add(new THREE.DirectionalLight(0xffffff, 0.22)); /* moves with the camera, so that no visible side is black */
    model.scene3.add(this.camera);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.enableKeys = false;
    this.controls.screenSpacePanning = true;
    this.controls.addEventListener('change', changed);
    this.controls.addEventListener('start', () => { this.fitted = false; });
    if (window.self !== window.top) { /* embedded in another page: the wheel scrolls that page until the user has clicked into the view */
      this.controls.enableZoom = false;
      canvas.addEventListener('pointerdown', () => { this.controls.enableZoom = true; });
    }
    this.addGrid();
    this.direction = this.chooseDirection();
  }

  /* Two horizontal directions, normal to `up`; the first is the projection of x, or of y if `up` is nearly along x */
  horizontal() {
    const along = Math.abs(this.up.x) < 0.9 ? new THREE.Vector3(1, 0, 0) : new THREE.Vector3(0, 1, 0);
    along.addScaledVector(this.up, -along.dot(this.up)).normalize();
    return [along, this.up.clone().cross(along)];
  }

  extents() {
    const size = this.model.bounds.getSize(new THREE.Vector3());
    return d => Math.abs(d.x) * size.x + Math.abs(d.y) * size.y + Math.abs(d.z) * size.z;
  }

  /* The direction from which the motion appears widest, a little from the side and from above */
  chooseDirection() {
    if (this.model.run.scene.planar) return new THREE.Vector3(0, 0, 1);
    const [a, b] = this.horizontal(), extent = this.extents(), across = extent(b) <= extent(a);
    const flat = extent(this.up) < 0.15 * Math.max(extent(a), extent(b));
    return a.clone().multiplyScalar(across ? 0.55 : 1).addScaledVector(b, across ? -1 : -0.55).addScaledVector(this.up, flat ? 0.85 : 0.42).normalize();
  }

  addGrid() {
    const {bounds, run} = this.model, planar = run.scene.planar, normal = planar ? new THREE.Vector3(0, 0, 1) : this.up;
    const [a, b] = planar ? [new THREE.Vector3(1, 0, 0), new THREE.Vector3(0, 1, 0)] : this.horizontal();
    const extent = this.extents(), centre = bounds.getCenter(new THREE.Vector3()), wide = Math.max(extent(a), extent(b), 0.4 * extent(normal));
    this.gridStep = roundStep(wide, 8);
    const half = this.gridStep * Math.ceil(0.8 * wide / this.gridStep), low = centre.dot(normal) - 0.5 * extent(normal) - 0.004 * this.model.size;
    /* grid lines are at multiples of the step from the origin of the scene */
    const offset = new THREE.Vector3(...this.model.origin), step = this.gridStep, round = d => Math.round((centre.dot(d) + offset.dot(d)) / step) * step - offset.dot(d);
    const middle = a.clone().multiplyScalar(round(a)).addScaledVector(b, round(b)).addScaledVector(normal, low);
    const point = [], n = Math.round(half / step);
    for (let k = -n; k <= n; k++)
      for (const [d, e] of [[a, b], [b, a]])
        for (const sign of [-1, 1]) point.push(middle.clone().addScaledVector(d, k * step).addScaledVector(e, sign * half));
    this.grid = new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(point), new THREE.LineBasicMaterial({transparent: true, opacity: 0.7}));
    this.floor = new THREE.Mesh(new THREE.PlaneBufferGeometry(2 * half, 2 * half), new THREE.ShadowMaterial({opacity: 0.16}));
    this.floor.position.copy(middle).addScaledVector(normal, -0.002 * this.model.size);
    this.floor.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(a, b, normal));
    this.floor.receiveShadow = true;
    this.floor.userData.floor = true;
    this.model.scene3.add(this.grid, this.floor);
    this.addShadows(centre, half, planar);
  }

  addShadows(centre, half, planar) {
    const sun = this.model.sun, [a, b] = this.horizontal(), reach = 1.5 * this.model.bounds.getSize(new THREE.Vector3()).length();
    sun.target.position.copy(centre);
    sun.position.copy(centre).addScaledVector(this.up, reach).addScaledVector(a, 0.35 * reach).addScaledVector(b, -0.5 * reach);
    if (planar) sun.position.copy(centre).addScaledVector(this.up, 0.4 * reach).add(new THREE.Vector3(-0.3 * reach, 0, reach));
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    Object.assign(sun.shadow.camera, {left: -0.5 * reach, right: 0.5 * reach, top: 0.5 * reach, bottom: -0.5 * reach, near: 0.1 * reach, far: 2.4 * reach});
    sun.shadow.camera.updateProjectionMatrix();
    sun.shadow.bias = -0.0006;
  }

  setTheme() {
    const style = getComputedStyle(document.documentElement), colour = name => new THREE.Color(style.getPropertyValue(name).trim());
    this.model.scene3.background = colour('--sky');
    this.grid.material.color = colour('--grid');
    this.floor.material.opacity = document.documentElement.dataset.theme === 'dark' ? 0.35 : 0.16;
  }

  resize() {
    const width = this.canvas.parentElement.clientWidth, height = this.canvas.parentElement.clientHeight;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  /* Fits the view to the whole motion. free: fraction of the height of the view that labels cover at the top. */
  fit(free = 0) {
    const {bounds, points} = this.model, direction = this.direction, right = this.up.clone().cross(direction);
    if (right.length() < 1e-6) right.set(1, 0, 0);
    right.normalize();
    const above = direction.clone().cross(right), tall = Math.tan(this.camera.fov * Math.PI / 360), wide = tall * this.camera.aspect;
    const target = bounds.getCenter(new THREE.Vector3()), d = new THREE.Vector3();
    let distance = 0;
    for (let pass = 0; pass < 4; pass++) { /* alternately computes the distance and the centre, which allows a smaller distance */
      distance = 0;
      for (const p of points) {
        d.copy(p).sub(target);
        distance = Math.max(distance, d.dot(direction) + Math.max(Math.abs(d.dot(right)) / wide, Math.abs(d.dot(above)) / (tall * (1 - free))) * 1.1);
      }
      const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
      for (const p of points) {
        d.copy(p).sub(target);
        const depth = distance - d.dot(direction);
        [right, above].forEach((axis, k) => {
          low[k] = Math.min(low[k], d.dot(axis) / depth);
          high[k] = Math.max(high[k], d.dot(axis) / depth);
        });
      }
      if (pass < 3) target.addScaledVector(right, 0.5 * distance * (low[0] + high[0])).addScaledVector(above, 0.5 * distance * (low[1] + high[1]));
    }
    this.camera.near = 0.005 * distance;
    this.camera.far = 40 * distance;
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(target).addScaledVector(above, free * tall * distance);
    this.camera.position.copy(this.controls.target).addScaledVector(direction, distance);
    this.controls.update();
    this.fitted = true;
  }

  /* Rotates the camera around the centre of the view: by `about` about the vertical axis, and by `away` from that axis,
     so that it does not reach the axis */
  turn(about, away) {
    const d = this.camera.position.clone().sub(this.controls.target).applyAxisAngle(this.up, about), angle = d.angleTo(this.up);
    d.applyAxisAngle(this.up.clone().cross(d).normalize(), Math.min(3.1, Math.max(0.04, angle + away)) - angle);
    this.camera.position.copy(this.controls.target).add(d);
    this.fitted = false;
    this.controls.update();
  }

  /* Moves the camera with a body */
  follow(body) {
    const g = this.model.bodies[body];
    if (!g || !g.visible) return;
    this.fitted = false;
    if (this.followed === body) {
      const by = g.position.clone().sub(this.followedAt);
      this.camera.position.add(by);
      this.controls.target.add(by);
      this.controls.update();
    }
    this.followed = body;
    this.followedAt = g.position.clone();
  }

  /* The object at a point of the page: {body, element (its name and type), object, surface, node}, or null */
  pick(x, y) {
    const box = this.canvas.getBoundingClientRect(), ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * (x - box.left) / box.width - 1, 1 - 2 * (y - box.top) / box.height), this.camera);
    const meshes = [];
    this.model.scene3.traverse(o => { if (o.isMesh && !o.userData.floor && !o.userData.ghost && this.model.shown(o)) meshes.push(o); });
    for (const s of this.model.run.surfaces) s.mesh.geometry.computeBoundingSphere();
    const hit = ray.intersectObjects(meshes)[0];
    if (!hit) return null;
    const surface = this.model.run.surfaces.find(s => s.mesh === hit.object);
    let o = hit.object;
    while (o && o.userData.body === undefined) o = o.parent;
    return {body: o ? o.userData.body : -1, element: hit.object.userData.element, object: hit.object, surface, node: surface ? surface.node[this.nearest(hit)] : -1};
  }

  nearest(hit) {
    const x = hit.object.geometry.attributes.position, at = hit.object.worldToLocal(hit.point.clone()), v = new THREE.Vector3();
    let best = -1, least = Infinity;
    for (const k of [hit.face.a, hit.face.b, hit.face.c]) {
      const d = v.fromBufferAttribute(x, k).distanceTo(at);
      if (d < least) [best, least] = [k, d];
    }
    return best;
  }

  /* The position of a point of the scene on the canvas, in CSS pixels; null if the point is behind the camera */
  project(point) {
    const p = point.clone().project(this.camera);
    return p.z > 1 ? null : [(p.x + 1) / 2 * this.canvas.clientWidth, (1 - p.y) / 2 * this.canvas.clientHeight];
  }

  draw() { this.renderer.render(this.model.scene3, this.camera); }

  /* Draws the axes of space, in the orientation of the camera, in a corner */
  drawAxes(canvas) {
    const g = canvas.getContext('2d'), middle = canvas.width / 2, inverse = this.camera.quaternion.clone().conjugate();
    g.clearRect(0, 0, canvas.width, canvas.height);
    g.font = 'bold 24px system-ui, "Liberation Sans", sans-serif';
    g.textAlign = 'center';
    g.textBaseline = 'middle';
    g.lineWidth = 4;
    const axes = [['x', '#d64545', 1, 0, 0], ['y', '#2f9e5b', 0, 1, 0], ['z', '#3b7ddd', 0, 0, 1]].map(([name, colour, ...d]) => ({name, colour, d: new THREE.Vector3(...d).applyQuaternion(inverse)}));
    for (const {name, colour, d} of axes.sort((p, q) => p.d.z - q.d.z)) {
      g.strokeStyle = g.fillStyle = colour;
      g.beginPath();
      g.moveTo(middle, middle);
      g.lineTo(middle + 46 * d.x, middle - 46 * d.y);
      g.stroke();
      if (Math.hypot(d.x, d.y) > 0.2) g.fillText(name, middle + 64 * d.x, middle - 64 * d.y);
    }
  }
}
