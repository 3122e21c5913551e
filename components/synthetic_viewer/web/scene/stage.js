// The scene on the graphics card, drawn for one view after the other into a canvas of its own.

import {
  BufferAttribute,
  BufferGeometry,
  LineSegments,
  Matrix4,
  Mesh,
  PerspectiveCamera,
  Quaternion,
  Scene,
  Vector3,
  WebGLRenderer,
} from 'three';
import {Batch} from './batch.js';
import {place} from './cameras.js';
import {Fluid} from './fluid.js';
import {liveObject} from './live_matter.js';
import {kOneByOne, makeMaterials, makeUniforms} from './look.js';
import {Paint} from './paint.js';
import {kViewBits} from './protocol.js';
import {makeShape} from './shapes.js';
import {WholeCheck} from './whole.js';

const kAllViews = 7;
const kBody = 100,
  kLiveColour = [236, 110, 28]; // order of a body; colour of live matter, as shown
const kManyAtOnce = 'WEBGL_multi_draw';
const matrixOf = rows => new Matrix4().set(...rows, 0, 0, 0, 1);
const geometryOf = (values, indices) => {
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(values), 3));
  return indices ? geometry.setIndex(indices) : geometry;
};

// Returns where a sphere is in a camera's picture: { x, y, radius } in shares of its width, height and height; null where it is not before the camera.
function circleOf({center, radius}, {matrixWorldInverse, projectionMatrix}) {
  const [, , z] = center.clone().applyMatrix4(matrixWorldInverse).toArray(),
    {x, y} = center.clone().applyMatrix4(matrixWorldInverse).applyMatrix4(projectionMatrix);
  return -z > radius
    ? {x: (x + 1) / 2, y: (1 - y) / 2, radius: (radius * projectionMatrix.elements[5]) / (-2 * z)}
    : null;
}

export class NoWebGl extends Error {
  name = 'NoWebGl';
}

// Returns whether the graphics card is the processor: every pixel costs much there.
function isSoftware(gl) {
  const names = gl.getExtension('WEBGL_debug_renderer_info');
  return /swiftshader|llvmpipe|software/i.test(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
}

export class Stage {
  // Nothing can be drawn before build(). Throws NoWebGl.
  constructor() {
    const choice = {alpha: false, stencil: true, powerPreference: 'high-performance'};
    this.canvas = document.createElement('canvas');
    const gl = this.canvas.getContext('webgl2', {...choice, antialias: true, xrCompatible: false}); // one: without a graphics card it takes seconds
    if (!gl) throw new NoWebGl('this browser has no WebGL 2');
    this.software = isSoftware(gl);
    this.renderer = new WebGLRenderer({canvas: this.canvas, context: gl, ...choice});
    this.renderer.autoClear = false;
    this.renderer.info.autoReset = false;
    this.renderer.setPixelRatio(1);
    this.camera = new PerspectiveCamera();
    this.paint = new Paint();
    this.meshes = new Map(); // by key: { positions, normals, indices }
    for (const shape of ['cone', 'cylinder', 'sphere', 'disc']) this.meshes.set(shape, makeShape(shape));
    this.items = new Map(); // by id, as the stream's messages, with their matrices
    this.bodies = []; // what they ride on
    this.poses = null; // the newest
    this.uniforms = makeUniforms(this.paint.texture);
    this.fluid = new Fluid(this.uniforms.cut);
    this.live = new Fluid(this.uniforms.cut); // of live matter, its body alone
    this.shownLive = new Set();
    this.live.setColours(new Map([[kBody, kLiveColour]]));
    this.live.setOpacity(1);
    Object.assign(this.live.shells.material, {transparent: false, depthWrite: true});
    this.live.shells.renderOrder = 0; // among the bodies, after what they stand on
    this.wholeCheck = new WholeCheck();
    this.oneByOne = false; // whether each item is drawn by a call of its own
    this.canvas.addEventListener('webglcontextrestored', () => {
      if (this.oneByOne) this.leaveOutManyAtOnce();
    }); // three's own listener came first
  }

  // `shaders`: the answer to GET /shaders.json. Throws Error where they are not as they must be. Returns this.
  build(shaders) {
    const materials = makeMaterials(shaders, this.uniforms);
    const findMesh = key => this.meshes.get(key);
    this.shadows = new Batch(materials.shadow, key => this.meshes.get(key)?.shadow);
    this.shadows.mesh.sortObjects = false;
    this.shadows.mesh.perObjectFrustumCulled = false; // they fall from what the picture does not show, too
    this.solid = new Batch(materials.solid, findMesh);
    this.clear = new Batch(materials.clear, findMesh);
    this.background = new Mesh(geometryOf([-1, -1, 0, 3, -1, 0, -1, 3, 0]), materials.background);
    this.floor = new Mesh(geometryOf([0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0], [0, 1, 2, 2, 1, 3]), materials.floor);
    this.lines = new LineSegments(geometryOf([0, 0, 0, 0, 0, 0]), materials.lines);
    this.drawLines();
    for (const mesh of [this.background, this.floor, this.lines]) mesh.frustumCulled = false;
    // What stands on the ground is drawn over it, whatever is nearer, as the server does.
    [this.background, this.floor, this.shadows.mesh].forEach((mesh, i) => {
      mesh.renderOrder = i - 3;
    });
    this.scene = new Scene().add(
      this.background,
      this.floor,
      this.shadows.mesh,
      this.lines,
      this.solid.mesh,
      this.clear.mesh,
    );
    this.scene.matrixWorldAutoUpdate = false;
    this.renderer.compile(this.scene, this.camera); // the graphics do it while meshes come; what few look at is compiled when it is shown
    this.scene.add(...this.fluid.meshes, this.live.shells);
    this.showLive(new Map());
    return this;
  }

  // Draws each item by a call of its own from now on, the solid ones also beyond the picture's edges, and in no order: what a driver can do wrong with many at
  // once is left out. Programs are made anew. Once only, and after build().
  drawOneByOne() {
    this.oneByOne = true;
    this.leaveOutManyAtOnce();
    for (const {material} of [this.shadows, this.solid, this.clear])
      Object.assign(material, {vertexShader: kOneByOne + material.vertexShader, needsUpdate: true});
    Object.assign(this.solid.mesh, {sortObjects: false, perObjectFrustumCulled: false});
  }
  leaveOutManyAtOnce() {
    const {extensions} = this.renderer,
      {get, has} = extensions;
    extensions.get = name => (name === kManyAtOnce ? null : get(name));
    extensions.has = name => name !== kManyAtOnce && has(name);
  }

  // It may come before build().
  setCell(cell) {
    this.cell = cell;
    const {uniforms} = this;
    uniforms.least.value.fromArray(cell.workspace.min_m);
    uniforms.greatest.value.fromArray(cell.workspace.max_m);
    uniforms.border.value = cell.floor_border_m;
    uniforms.pitch.value = cell.floor_pitch_m;
    uniforms.to_key_light.value.fromArray(cell.to_key_light);
    uniforms.shadow.value.w = cell.shadow_opacity;
    uniforms.line.value.set(...cell.line_colour, 1);
    cell.paint_ramp.forEach((colour, i) => uniforms.ramp.value[i].fromArray(colour));
    this.drawLines();
    this.paint.setBoxes(cell.bodies.filter(body => body.link !== undefined).map(body => body.box));
    this.bodies = cell.bodies.map(() => new Matrix4());
    if (this.poses) this.setPoses(this.poses); // it comes anew with each connection, the poses only when they are others
  }

  drawLines() {
    if (!this.lines || !this.cell) return;
    this.lines.geometry.dispose();
    this.lines.geometry = geometryOf(this.cell.lines.flat());
  }

  // Lets the section of the fluid cut objects open, or not: the arm is never cut.
  setCutting(cutting) {
    if (cutting === this.fluid.cutting.value) return;
    this.fluid.cutting.value = cutting;
    for (const {material} of [this.solid, this.clear])
      Object.assign(material, {defines: cutting ? {CUT: 1} : {}, needsUpdate: true});
  }

  // Shows live matter (of decodeShell(), by ids) in all views.
  showLive(shells) {
    this.shownLive = new Set(shells.keys());
    this.live.showShells([...shells.values()]);
    this.live.shells.visible = this.live.count > 0;
  }

  // Takes a message of the type `item`. Returns the mesh that it needs; null if it needs none, or that is there.
  setItem(message) {
    if (message.gone) {
      this.items.delete(message.id);
      this.dropMeshes();
      return null;
    }
    this.items.set(message.id, {...message, body_from_mesh: matrixOf(message.matrix), W_from_mesh: new Matrix4()});
    this.dropMeshes();
    return this.meshes.has(message.mesh) ? null : message.mesh;
  }
  // Forgets the meshes that no item has any more.
  dropMeshes() {
    const kept = new Set(['cone', 'cylinder', 'sphere', 'disc', ...[...this.items.values()].map(item => item.mesh)]);
    for (const key of this.meshes.keys())
      if (!kept.has(key)) {
        this.meshes.delete(key);
        this.stale = true;
      }
    this.kept = kept;
  }
  addMesh(key, mesh) {
    if ([...this.items.values()].some(item => item.mesh === key)) this.meshes.set(key, mesh);
  }

  setPoses(poses) {
    this.poses = poses;
    poses.bodies.forEach(({origin_m, turn}, i) =>
      this.bodies[i]?.compose(new Vector3(...origin_m), new Quaternion(...turn), new Vector3(1, 1, 1)),
    );
  }
  setPaint(message) {
    if (this.paint.show(message)) this.uniforms.paint.value = this.paint.texture;
  }

  // Places all items as they are now.
  update() {
    const solid = [],
      clear = [],
      {poses} = this;
    for (const item of this.items.values()) {
      const body = this.bodies[item.body];
      if (this.shownLive.has(liveObject(item.id))) continue; // its voxels are there
      if (item.body >= 0 && (!body || !poses || poses.bodies.length === 0)) continue;
      if (body) item.W_from_mesh.multiplyMatrices(body, item.body_from_mesh);
      else item.W_from_mesh.copy(item.body_from_mesh);
      if (poses?.painted && item.paint && item.lookedUp !== this.paint.number) {
        item.lookedUp = this.paint.number;
        item.look = this.paint.lookUp(item.link, item.paint);
      }
      (item.opacity < 1 ? clear : solid).push({
        mesh: item.mesh,
        W_from_mesh: item.W_from_mesh,
        colour: item.colour,
        opacity: item.opacity,
        ownLight: item.own_light,
        shadow: item.shadow,
        views: kAllViews,
        name: item.name,
        cut: item.id.startsWith('object:'),
        paint: poses?.painted && item.paint ? item.look : null,
      });
    }
    for (const mark of poses?.marks ?? []) {
      if (mark.shape === null) continue;
      (mark.opacity < 1 ? clear : solid).push({
        mesh: mark.shape,
        colour: mark.colour,
        opacity: mark.opacity,
        ownLight: mark.ownLight,
        shadow: false,
        views: mark.views,
        paint: null,
        W_from_mesh: new Matrix4().compose(
          new Vector3(...mark.origin_m),
          new Quaternion(...mark.turn),
          new Vector3(...mark.scale),
        ),
      });
    }
    this.solid.show(solid);
    this.shadows.show([...solid, ...clear].filter(item => item.shadow));
    this.clear.show(clear);
    if (this.stale) {
      this.stale = false;
      for (const batch of [this.solid, this.shadows, this.clear]) batch.keepOnly(this.kept);
    }
  }

  // Draws what `view` ('main', 'hit', 'tool') shows. `camera`: three's; `target` sets where to draw.
  drawScene(view, camera) {
    const {renderer} = this;
    this.background.visible = !renderer.xr.isPresenting; // it is the picture's, not the room's
    renderer.clear();
    this.fluid.face(view === 'main' ? camera.matrixWorld.elements.slice(12, 15) : null); // a hit zone lies within it
    this.shadows.mesh.visible =
      this.shadows.items.length > 0 && camera.matrixWorld.elements[14] > this.uniforms.least.value.z; // from above
    this.solid.select(kViewBits[view]);
    this.clear.mesh.visible = this.clear.select(kViewBits[view]) > 0;
    renderer.render(this.scene, camera);
  }

  // Draws a view into a 2D context of width × height pixels, of which `inset_px` at the left are covered: the middle is that of the rest.
  draw(view, camera, context, inset_px = 0) {
    const {width, height} = context.canvas;
    if (this.canvas.width < width || this.canvas.height < height) {
      this.renderer.setSize(Math.max(this.canvas.width, width), Math.max(this.canvas.height, height), false);
    }
    this.place(camera, context, inset_px);
    this.renderer.setViewport(0, 0, width, height);
    this.renderer.setScissor(0, 0, width, height);
    this.renderer.setScissorTest(true);
    this.drawScene(view, this.camera);
    context.drawImage(this.canvas, 0, this.canvas.height - height, width, height, 0, 0, width, height);
  }
  place(camera, {canvas: {width, height}}, inset_px) {
    place(this.camera, camera, width / height);
    if (inset_px > 0) this.camera.setViewOffset(width, height, -inset_px / 2, 0, width, height);
    else if (this.camera.view?.enabled) this.camera.clearViewOffset();
  }
  // Returns whether the bodies are in the picture of a view; null where that cannot be told. Draws it twice.
  isWhole(view, camera, context, inset_px = 0) {
    const draw = withBodies => {
      this.solid.mesh.visible = withBodies;
      this.draw(view, camera, context, inset_px);
      return context.canvas;
    };
    this.place(camera, context, inset_px);
    return this.wholeCheck.run(
      draw,
      this.solid
        .spheres()
        .map(sphere => circleOf(sphere, this.camera))
        .filter(Boolean),
    );
  }
}
