// The fluid on the graphics card: shells of its layers, all in one draw call, and a section through it in which one voxel is one cell.
// Both are given as the viewer sends them (README.md, "The fluid"); a colour stands for an order, by the scale.

import {
  BufferAttribute,
  BufferGeometry,
  DataTexture,
  FrontSide,
  DoubleSide,
  GLSL3,
  InterleavedBuffer,
  InterleavedBufferAttribute,
  Mesh,
  NoBlending,
  NormalBlending,
  RedFormat,
  ShaderMaterial,
  Vector2,
  Vector3,
} from 'three';

const kBoundary = 100,
  kGuard = 99,
  kInterior = 101,
  kShellHeader = 32,
  kSectionHeader = 48;

export const kFaceNumbers = 6; // of a rectangle, 16 bits each

const makeSquare = () =>
  new BufferGeometry()
    .setAttribute('position', new BufferAttribute(new Float32Array([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0]), 3))
    .setIndex([0, 1, 2, 0, 2, 3]);

// How deep a voxel of an order lies: depth_of() in fluid_shape.hpp.
export function depthOf(order) {
  if (order === kBoundary) return 1;
  return order === kInterior ? 127 : order === kGuard ? 0 : order > 0 ? -order : 1 - order;
}

// Returns the colours of orders, 0…255 as shown: the layers by the ramp of closeness (linear), the nearest as what touches; bodies grey.
export function coloursOf(orders, ramp) {
  const layers = orders.filter(order => order > 0 && order < kGuard).length,
    inner = orders.filter(order => order < 0).length;
  const mix = (a, b, share) => a.map((part, i) => part + share * (b[i] - part));
  const linear = order => {
    if (order === kGuard) return [0.9, 0.9, 0.9];
    if (order < 0) return mix([0.35, 0.35, 0.38], [0.08, 0.08, 0.1], -order / Math.max(1, inner));
    if (order >= kBoundary) return [0.5, 0.5, 0.5];
    const closeness = layers > 1 ? (layers - order) / (layers - 1) : 0.5;
    return closeness < 0.5 ? mix(ramp[0], ramp[1], 2 * closeness) : mix(ramp[1], ramp[2], 2 * closeness - 1);
  };
  return new Map(
    orders.map(order => [
      order,
      linear(order).map(part => Math.round(255 * Math.sqrt(Math.min(1, Math.max(0, part))))),
    ]),
  );
}

// Where the voxels of an answer are: their grid's corner and their sides, m.
const placeOf = buffer => ({
  origin_m: [...new Float32Array(buffer, 0, 3)],
  sides_m: [...new Float32Array(buffer, 12, 3)],
});
// Reads the answer to GET /fluid/shell/…; throws RangeError if it is not whole.
export function decodeShell(buffer) {
  const count = new DataView(buffer).getUint32(24, true);
  return {...placeOf(buffer), faces: new Uint16Array(buffer, kShellHeader, kFaceNumbers * count)};
}
// Reads the answer to GET /fluid/section/…, likewise.
export function decodeSection(buffer) {
  const [axis, at, u, v, width, height] = new Int32Array(buffer, 24, 6);
  return {
    ...placeOf(buffer),
    axis,
    at,
    least: [u, v],
    size: [width, height],
    orders: new Uint8Array(buffer, kSectionHeader, width * height),
  };
}

const kCut =
  'uniform vec4 cut;\nuniform bool cutting;\n#define is_cut_off (cutting && dot(cut, vec4(world_position, 1.0)) > 0.0)\n';
const kPlace = /* glsl */ `
uniform vec3 origin_m, sides_m;  // of the voxels
vec3 in_world(vec3 voxels) { return origin_m + sides_m * voxels; }
`;

const kShellVertex = /* glsl */ `
${kPlace}
in vec3 corner;
in vec3 extent;  // along and across the normal's axis, voxels; side and order
uniform sampler2D scale;
out vec3 world_position;
flat out vec3 shade;
void main() {
  int kind = int(extent.z), axis = (kind & 255) >> 1;
  bool down = (kind & 1) != 0;
  int number = gl_VertexID & 3;
  vec2 turn = vec2(number == 1 || number == 2, number > 1), place = extent.xy * (down ? turn.yx : turn);  // counter-clockwise seen from outside
  vec3 voxels = corner, normal = vec3(0.0);
  voxels[(axis + 1) % 3] += place.x;
  voxels[(axis + 2) % 3] += place.y;
  normal[axis] = down ? -1.0 : 1.0;
  world_position = in_world(voxels);
  float light = 0.82 + 0.18 * dot(normal, vec3(0.348, -0.464, 0.815));
  shade = light * texelFetch(scale, ivec2(kind >> 8, 0), 0).rgb;
  gl_Position = projectionMatrix * viewMatrix * vec4(world_position, 1.0);
}
`;
const kShellFragment = /* glsl */ `
in vec3 world_position;
flat in vec3 shade;
uniform float opacity;
${kCut}
out vec4 result;
void main() {
  if (is_cut_off) discard;
  result = vec4(shade, opacity);
}
`;

const kSectionVertex = /* glsl */ `
${kPlace}
uniform int axis;
uniform float at;
uniform vec2 least;
uniform vec2 size;
out vec2 cell;
void main() {
  cell = size * position.xy;
  vec3 voxels;
  voxels[axis] = at + 0.5;
  voxels[(axis + 1) % 3] = least.x + cell.x;
  voxels[(axis + 2) % 3] = least.y + cell.y;
  gl_Position = projectionMatrix * viewMatrix * vec4(in_world(voxels), 1.0);
}
`;
// Where nothing is, only the border of the section is drawn.
const kSectionFragment = /* glsl */ `
in vec2 cell;
uniform vec2 size;
uniform sampler2D orders;
uniform sampler2D scale;
out vec4 result;
void main() {
  int order = int(255.0 * texelFetch(orders, ivec2(clamp(cell, vec2(0.0), size - 1.0)), 0).r + 0.5);
  vec2 inside = min(cell, size - cell) / max(fwidth(cell), vec2(1e-6));
  if (order == 0 && min(inside.x, inside.y) > 1.5) discard;
  result = order == 0 ? vec4(0.6, 0.65, 0.7, 1.0) : vec4(texelFetch(scale, ivec2(order, 0), 0).rgb, 1.0);
}
`;

export class Fluid {
  // `cut`: the uniform of the plane beyond which nothing is drawn while `cutting`, shared with what else it cuts.
  constructor(cut) {
    this.scale = new DataTexture(new Uint8Array(4 * 256), 256, 1);
    this.orders = new DataTexture(new Uint8Array(1), 1, 1, RedFormat);
    const shared = {scale: {value: this.scale}},
      program = (vertexShader, fragmentShader, uniforms, more) =>
        new ShaderMaterial({
          glslVersion: GLSL3,
          vertexShader,
          fragmentShader,
          uniforms: {...shared, origin_m: {value: new Vector3()}, sides_m: {value: new Vector3()}, ...uniforms},
          ...more,
        });
    this.cutting = {value: false};
    this.shells = new Mesh(
      new BufferGeometry(),
      program(
        kShellVertex,
        kShellFragment,
        {opacity: {value: 0.3}, cut, cutting: this.cutting},
        {side: FrontSide, transparent: true, blending: NormalBlending, depthWrite: false},
      ),
    );
    this.section = new Mesh(
      makeSquare(),
      program(
        kSectionVertex,
        kSectionFragment,
        {
          orders: {value: this.orders},
          axis: {value: 0},
          at: {value: 0},
          least: {value: new Vector2()},
          size: {value: new Vector2(1, 1)},
        },
        {side: DoubleSide, blending: NoBlending},
      ),
    );
    Object.assign(this, {cut, sectioned: false});
    this.showShells([]);
    for (const mesh of [this.shells, this.section]) mesh.frustumCulled = false;
    this.shells.renderOrder = -1; // before the marks that are seen through
  }
  get meshes() {
    return [this.shells, this.section];
  }

  // `colours`: of coloursOf().
  setColours(colours) {
    this.scale.image.data.fill(0);
    for (const [order, colour] of colours) this.scale.image.data.set([...colour, 255], 4 * (order & 255));
    this.scale.needsUpdate = true;
  }

  // Shows shells (of decodeShell(), all of one workspace), the innermost first.
  showShells(shells) {
    const count = shells.reduce((sum, {faces}) => sum + faces.length / kFaceNumbers, 0);
    // Each corner has its rectangle's numbers.
    const corners = new Uint16Array(4 * kFaceNumbers * count),
      indices = new Uint32Array(6 * count),
      geometry = new BufferGeometry();
    let at = 0;
    for (const {faces} of shells) {
      for (let face = 0; face < faces.length; face += kFaceNumbers) {
        for (let corner = 0; corner < 4; ++corner, at += kFaceNumbers)
          for (let i = 0; i < kFaceNumbers; ++i) corners[at + i] = faces[face + i];
      }
    }
    for (let face = 0; face < count; ++face)
      [0, 1, 2, 0, 2, 3].forEach((corner, i) => {
        indices[6 * face + i] = 4 * face + corner;
      });
    const buffer = new InterleavedBuffer(corners, kFaceNumbers);
    geometry
      .setAttribute('corner', new InterleavedBufferAttribute(buffer, 3, 0))
      .setAttribute('extent', new InterleavedBufferAttribute(buffer, 3, 3));
    geometry.setIndex(new BufferAttribute(indices, 1));
    this.shells.geometry.dispose();
    this.shells.geometry = geometry;
    this.count = count;
    if (shells.length) this.place(this.shells, shells[0]);
  }
  place({material}, {origin_m, sides_m}) {
    material.uniforms.origin_m.value.fromArray(origin_m);
    material.uniforms.sides_m.value.fromArray(sides_m);
  }
  setOpacity(opacity) {
    this.shells.material.uniforms.opacity.value = opacity;
  }

  // Shows a section (of decodeSection()); null: none.
  showSection(section) {
    this.sectioned = section !== null;
    if (!section) return;
    const {uniforms} = this.section.material,
      {image} = this.orders;
    if (image.width !== section.size[0] || image.height !== section.size[1]) this.orders.dispose();
    this.orders.image = {data: section.orders, width: section.size[0], height: section.size[1]};
    this.orders.needsUpdate = true;
    this.place(this.section, section);
    Object.assign(uniforms.axis, {value: section.axis});
    Object.assign(uniforms.at, {value: section.at});
    uniforms.least.value.fromArray(section.least);
    uniforms.size.value.fromArray(section.size);
  }

  // Shows what is to be seen by an eye, three numbers in W, of which the section cuts off its side; null: nothing.
  face(eye) {
    this.shells.visible = eye !== null && this.count > 0;
    this.section.visible = eye !== null && this.sectioned;
    this.cut.value.set(0, 0, 0, 0);
    if (eye === null || !this.cutting.value) return;
    const {origin_m, sides_m, axis, at} = this.section.material.uniforms;
    const place = origin_m.value.getComponent(axis.value) + sides_m.value.getComponent(axis.value) * (at.value + 0.5);
    const towards = Math.sign(eye[axis.value] - place) || 1;
    this.cut.value.set(0, 0, 0, -towards * place).setComponent(axis.value, towards);
  }
}
