#pragma once

// The GLSL programs of the renderer. Lighting is computed in linear colour. The last step is a square root,
// which is close to the display's transfer curve and far cheaper than its exact power in software.

namespace phantom::synthetic_viewer::shaders {

inline constexpr const char* kMeshVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
uniform mat4 clip_from_world;
uniform mat4 world_from_mesh;
uniform mat3 normal_matrix;
out vec3 world_position;
out vec3 world_normal;
#ifdef PAINTED
uniform mat4 texture_from_mesh;
out vec3 paint_place;
#endif
void main() {
#ifdef PAINTED
  paint_place = (texture_from_mesh * vec4(position, 1.0)).xyz;
#endif
  vec4 world = world_from_mesh * vec4(position, 1.0);
  world_position = world.xyz;
  world_normal = normal_matrix * normal;
  gl_Position = clip_from_world * world;
}
)";

/// Lighting: a key light, a cool fill light, sky and floor light by the normal, a small highlight, and a rim
/// light that separates bodies from the dark background. With PAINTED, the colour of the closeness covers the
/// item's colour and also glows a little. With OVER_VIDEO, too, there is nothing but that colour.
inline constexpr const char* kMeshFragment = R"(#version 330 core
in vec3 world_position;
in vec3 world_normal;
uniform vec3 eye;
uniform vec4 colour;
uniform float own_light;
#ifdef PAINTED
in vec3 paint_place;
uniform sampler3D paint;
uniform vec3 ramp[3];
#endif
out vec4 result;
const vec3 key_direction = vec3(0.348, -0.464, 0.815);
const vec3 fill_direction = vec3(-0.696, 0.596, 0.400);
void main() {
  vec3 n = normalize(world_normal);
  vec3 to_eye = normalize(eye - world_position);
  if (dot(n, to_eye) < 0.0) n = -n;
  float key = max(dot(n, key_direction), 0.0);
  float fill = max(dot(n, fill_direction), 0.0);
  vec3 sky = mix(vec3(0.13, 0.12, 0.12), vec3(0.30, 0.33, 0.38), 0.5 + 0.5 * n.z);
  vec3 light = sky + key * vec3(0.82, 0.79, 0.74) + fill * vec3(0.16, 0.20, 0.27);
  float glint = max(dot(n, normalize(key_direction + to_eye)), 0.0);
  glint *= glint; glint *= glint; glint *= glint; glint *= glint; glint *= glint;
  float edge = 1.0 - max(dot(n, to_eye), 0.0);
  edge *= edge * edge;
  vec3 own = colour.rgb;
  float shine = own_light;
#ifdef PAINTED
  float closeness = texture(paint, paint_place).r;
  vec3 shade = closeness < 0.5 ? mix(ramp[0], ramp[1], 2.0 * closeness) : mix(ramp[1], ramp[2], 2.0 * closeness - 1.0);
  float cover = clamp(closeness * 5.0, 0.0, 1.0);
  own = mix(own, shade, 0.9 * cover);
  shine = max(shine, 0.3 * cover);
#endif
  vec3 lit = own * light + glint * 0.14 + edge * vec3(0.05, 0.06, 0.075);
  result = vec4(sqrt(min(mix(lit, own, shine), vec3(1.0))), colour.a);
#ifdef OVER_VIDEO
  result = vec4(sqrt(shade), 0.75 * cover);
#endif
}
)";

inline constexpr const char* kFlatVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
uniform mat4 clip_from_mesh;
void main() { gl_Position = clip_from_mesh * vec4(position, 1.0); }
)";

inline constexpr const char* kFlatFragment = R"(#version 330 core
uniform vec4 colour;
out vec4 result;
void main() { result = vec4(sqrt(colour.rgb), colour.a); }
)";

/// One triangle that covers the picture. The picture is drawn upside down, so clip y = −1 is its upper edge.
inline constexpr const char* kBackgroundVertex = R"(#version 330 core
out vec2 place;
void main() {
  vec2 corner = vec2(float((gl_VertexID & 1) << 2) - 1.0, float((gl_VertexID & 2) << 1) - 1.0);
  place = corner;
  gl_Position = vec4(corner, 1.0, 1.0);
}
)";

inline constexpr const char* kBackgroundFragment = R"(#version 330 core
in vec2 place;
out vec4 result;
void main() {
  float down = 0.5 + 0.5 * place.y;
  vec3 colour = mix(vec3(0.225, 0.260, 0.305), vec3(0.085, 0.095, 0.115), down);
  float corner = dot(place, place);
  result = vec4(colour * (1.0 - 0.10 * corner), 1.0);
}
)";

/// A picture as the background, without smoothing: it has the size of what is drawn.
inline constexpr const char* kBackdropFragment = R"(#version 330 core
in vec2 place;
uniform sampler2D picture;
out vec4 result;
void main() { result = vec4(texture(picture, 0.5 + 0.5 * place).rgb, 1.0); }
)";

inline constexpr const char* kFloorVertex = R"(#version 330 core
uniform mat4 clip_from_world;
uniform vec3 least;
uniform vec3 greatest;
uniform float border;
out vec2 place;
void main() {
  vec2 low = least.xy - border, high = greatest.xy + border;
  place = vec2((gl_VertexID & 1) != 0 ? high.x : low.x, (gl_VertexID & 2) != 0 ? high.y : low.y);
  gl_Position = clip_from_world * vec4(place, least.z, 1.0);
}
)";

/// Draws lines every `pitch` metres, each fifth stronger. The floor fades out over `border` around the
/// workspace.
inline constexpr const char* kFloorFragment = R"(#version 330 core
in vec2 place;
uniform vec3 least;
uniform vec3 greatest;
uniform float border;
uniform float pitch;
out vec4 result;
float lines(float step, float width) {
  vec2 scaled = place / step;
  vec2 away = abs(fract(scaled - 0.5) - 0.5) / max(fwidth(scaled), vec2(1e-6));
  float fade = clamp(1.0 - 2.0 * max(fwidth(scaled).x, fwidth(scaled).y), 0.0, 1.0);
  return fade * (1.0 - clamp(min(away.x, away.y) / width, 0.0, 1.0));
}
void main() {
  vec2 outside = max(max(least.xy - place, place - greatest.xy), vec2(0.0));
  float cover = 1.0 - clamp(length(outside) / border, 0.0, 1.0);
  vec3 base = vec3(0.185, 0.205, 0.235);
  vec3 colour = base + lines(pitch, 1.0) * 0.045 + lines(5.0 * pitch, 1.3) * 0.10;
  result = vec4(colour, cover * cover);
}
)";

}  // namespace phantom::synthetic_viewer::shaders
