// How things look. The fragments' programs are the server's own (GET /shaders.json, shaders.hpp), so lighting and palette are written once.
// Here is only what differs: all items of a kind are drawn at once, so what is a uniform there comes from textures here (batch.js).

import {
  CustomBlending,
  DoubleSide,
  EqualStencilFunc,
  FrontSide,
  GLSL3,
  IncrementStencilOp,
  KeepStencilOp,
  NoBlending,
  NormalBlending,
  ShaderMaterial,
  Vector3,
  Vector4,
} from 'three';

// What an item has beside matrix and colour, in a row of texels: its opacity, own light, whether a section cuts it, and whether it is painted; then the matrix from its mesh to the paint's texture, by rows; then the part of that texture that is its own.
export const kTexelsPerItem = 8;

// three's batching chunk takes the number of a draw from the extension wherever there is one, also where the calls are made one by one (kOneByOne).
const kBatching = /* glsl */ `
#include <batching_pars_vertex>
#if defined(ONE_BY_ONE) && defined(GL_ANGLE_multi_draw)
uniform int _gl_DrawID;
#define draw_number _gl_DrawID
#else
#define draw_number gl_DrawID
#endif
`;
export const kOneByOne = '#define ONE_BY_ONE\n'; // before the program of what is in a batch

const kItem = /* glsl */ `
${kBatching}
uniform highp sampler2D items;
vec4 item_texel(float item, int number) {
  int at = int(item) * ${kTexelsPerItem} + number, width = textureSize(items, 0).x;
  return texelFetch(items, ivec2(at % width, at / width), 0);
}
`;

const kMeshVertex = /* glsl */ `
${kItem}
out vec3 world_position;
out vec3 world_normal;
out vec3 paint_place;
flat out vec3 paint_low;
flat out vec3 paint_high;
flat out vec4 colour;
flat out float own_light;
flat out float painted;
#ifdef CUT
flat out float may_be_cut;
#endif
void main() {
  float item = getIndirectIndex(draw_number);
  mat4 world_from_mesh = getBatchingMatrix(item);
  vec4 kind = item_texel(item, 0), place = vec4(position, 1.0);
  colour = vec4(getBatchingColor(item).rgb, kind.x);
  own_light = kind.y;
  painted = kind.w;
#ifdef CUT
  may_be_cut = kind.z;
#endif
  if (painted > 0.5) {
    paint_place = vec3(dot(item_texel(item, 1), place), dot(item_texel(item, 2), place), dot(item_texel(item, 3), place));
    paint_low = item_texel(item, 4).xyz;
    paint_high = item_texel(item, 5).xyz;
  }
  vec4 world = world_from_mesh * place;
  world_position = world.xyz;
  mat3 turn = mat3(world_from_mesh);  // its columns are at right angles
  world_normal = turn * (normal / vec3(dot(turn[0], turn[0]), dot(turn[1], turn[1]), dot(turn[2], turn[2])));
  gl_Position = projectionMatrix * viewMatrix * world;
}
`;

// Shadows fall along the key light onto the floor.
const kShadowVertex = /* glsl */ `
${kBatching}
uniform vec3 to_key_light;
uniform vec3 least;
void main() {
  vec3 world = (getBatchingMatrix(getIndirectIndex(draw_number)) * vec4(position, 1.0)).xyz;
  vec2 slope = to_key_light.xy / to_key_light.z;
  gl_Position = projectionMatrix * viewMatrix * vec4(world.xy - slope * (world.z - least.z), least.z, 1.0);
}
`;

const kLineVertex = 'void main() { gl_Position = projectionMatrix * viewMatrix * vec4(position, 1.0); }';

const kBackgroundVertex = /* glsl */ `
out vec2 place;
void main() {
  place = vec2(position.x, -position.y);
  gl_Position = vec4(position.xy, 1.0, 1.0);
}
`;

const kFloorVertex = /* glsl */ `
uniform vec3 least;
uniform vec3 greatest;
uniform float border;
out vec2 place;
void main() {
  place = mix(least.xy - border, greatest.xy + border, position.xy);
  gl_Position = projectionMatrix * viewMatrix * vec4(place, least.z, 1.0);
}
`;

// Returns a program of the server's for a ShaderMaterial, with words of it exchanged. Throws if one is not there.
function exchanged({fragment}, ...words) {
  let text = fragment.replace(/^#version[^\n]*\n/, '');
  for (const [from, to] of words) {
    if (!text.includes(from)) throw new Error(`the viewer's shaders have no "${from}"`);
    text = text.replace(from, to);
  }
  return text;
}

function meshFragment(shaders) {
  return exchanged(
    shaders.painted,
    ['uniform vec3 eye;', '#define eye cameraPosition'],
    ['uniform vec4 colour;', 'flat in vec4 colour;'],
    [
      'uniform float own_light;',
      'flat in float own_light;\nflat in float painted;\nflat in vec3 paint_low;\nflat in vec3 paint_high;',
    ],
    [
      'void main() {',
      `#ifdef CUT
uniform vec4 cut;
flat in float may_be_cut;
#endif
void main() {
#ifdef CUT
  if (may_be_cut > 0.5 && dot(cut, vec4(world_position, 1.0)) > 0.0) discard;
#endif`,
    ],
    [
      'texture(paint, paint_place)',
      '(painted > 0.5 ? texture(paint, clamp(paint_place, paint_low, paint_high)) : vec4(0.0))',
    ],
  );
}

const program = (vertexShader, fragmentShader, uniforms, more = {}) =>
  new ShaderMaterial({glslVersion: GLSL3, vertexShader, fragmentShader, uniforms, blending: NoBlending, ...more});
// What stands on the ground lies under all else: three draws it among what is opaque, in the order of its numbers, mixed with what is there.
const kUnderAll = {depthTest: false, depthWrite: false, blending: CustomBlending};
const kSeeThrough = {transparent: true, blending: NormalBlending, depthWrite: false};

// What the materials of a stage share; from the stream's messages.
export const makeUniforms = paint => ({
  paint: {value: paint},
  ramp: {value: [new Vector3(), new Vector3(), new Vector3()]},
  least: {value: new Vector3()},
  greatest: {value: new Vector3()},
  border: {value: 0.5},
  pitch: {value: 0.1},
  to_key_light: {value: new Vector3(0, 0, 1)},
  shadow: {value: new Vector4(0, 0, 0, 0.33)},
  cut: {value: new Vector4()},
  line: {value: new Vector4(0, 0, 0, 1)},
});

// Returns the materials of a stage. `shaders`: the answer to GET /shaders.json.
export function makeMaterials(shaders, uniforms) {
  const {paint, ramp, least, greatest, border, pitch, to_key_light, cut} = uniforms;
  const fragment = meshFragment(shaders),
    flat = exchanged(shaders.flat);
  return {
    solid: items => program(kMeshVertex, fragment, {items, paint, ramp, cut}, {side: FrontSide}),
    clear: items => program(kMeshVertex, fragment, {items, paint, ramp, cut}, {side: FrontSide, ...kSeeThrough}),
    // Of shadows that overlap only the first darkens.
    shadow: () =>
      program(
        kShadowVertex,
        flat,
        {to_key_light, least, colour: uniforms.shadow},
        {
          ...kUnderAll,
          side: DoubleSide,
          stencilWrite: true,
          stencilFunc: EqualStencilFunc,
          stencilRef: 0,
          stencilFail: KeepStencilOp,
          stencilZFail: KeepStencilOp,
          stencilZPass: IncrementStencilOp,
        },
      ),
    lines: program(kLineVertex, flat, {colour: uniforms.line}),
    background: program(kBackgroundVertex, exchanged(shaders.background), {}, {...kUnderAll, blending: NoBlending}),
    floor: program(
      kFloorVertex,
      exchanged(shaders.floor),
      {least, greatest, border, pitch},
      {...kUnderAll, side: DoubleSide},
    ),
  };
}
