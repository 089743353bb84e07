#include "client/view/shaders.hpp"

namespace palpate::shaders {
namespace {

// A disc of taps, evenly spread (golden angle); each tap is itself a bilinear comparison of four texels. On the body the disc is
// rotated from pixel to pixel (interleaved gradient noise: J. Jimenez, SIGGRAPH 2014 courses), so that few taps give grain
// instead of bands; on the floor, whose pixels are large, grain would appear as spots.
const char* const kShadow = R"GLSL(
uniform sampler2DShadow u_key_map;
uniform mat4 u_key_matrix;
uniform int u_taps;
float grain() { return 6.283185 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))); }
float lit_fraction(sampler2DShadow map, mat4 matrix, vec3 p, float radius, float turn) {
  vec3 at = (matrix * vec4(p, 1.0)).xyz * 0.5 + 0.5;
  float sum = 0.0;
  const mat2 golden = mat2(-0.7373688, 0.6754903, -0.6754903, -0.7373688);
  vec2 to = radius * inversesqrt(float(u_taps)) * vec2(cos(turn), sin(turn));
  for (int i = 0; i < u_taps; ++i) {
    sum += texture(map, vec3(at.xy + sqrt(float(i) + 0.5) * to, at.z));
    to = golden * to;
  }
  return sum / float(u_taps);
}
)GLSL";

// Key light with a wrapped terminator (light scattered under the skin), fill from the eye's right, rim from behind, hemisphere
// ambient, two glossy lobes. Inputs are centroid samples: at a silhouette they must not be extrapolated. All in linear light; the
// last line is a filmic shoulder and the sRGB curve.
const char* const kStudio = R"GLSL(
uniform vec3 u_eye, u_key_direction, u_fill_direction, u_rim_direction;
uniform vec3 u_key, u_fill, u_rim, u_sky, u_floor;
vec3 studio(vec3 albedo, vec3 n, vec3 p, float skin, float gloss, float open, float lit) {
  vec3 v = normalize(u_eye - p), h = normalize(v + u_key_direction);
  float nl = dot(n, u_key_direction), nv = max(dot(n, v), 0.0);
  vec3 wrap = skin * vec3(0.34, 0.16, 0.12);
  vec3 key = max((vec3(nl) + wrap) / (1.0 + wrap), 0.0) * mix(wrap * 0.5, vec3(1.0), lit);
  vec3 light = u_key * key + u_fill * max(dot(n, u_fill_direction) * 0.6 + 0.4, 0.0) * open;
  light += mix(u_floor, u_sky, 0.5 + 0.5 * n.z) * open;
  float graze = (1.0 - nv) * (1.0 - nv), fresnel = graze * graze;
  float h1 = max(dot(n, h), 0.0), h2 = h1 * h1, h4 = h2 * h2, h8 = h4 * h4, h16 = h8 * h8, h64 = h16 * h16 * h16 * h16;
  vec3 shine = u_key * lit * gloss * (0.55 * h64 * h16 * h8 * h2 + 0.10 * h8 * h4 * h2) * max(nl, 0.0);  // to the 90th, the 14th
  shine += u_rim * fresnel * (0.25 + 0.75 * max(dot(n, u_rim_direction), 0.0)) * (0.25 + 0.5 * gloss) * open;
  shine += mix(u_floor, u_sky, smoothstep(-0.2, 0.6, reflect(-v, n).z)) * gloss * (0.05 + 0.6 * fresnel) * open;
  return albedo * light * 0.42 + shine;
}
vec3 develop(vec3 c) {
  c = c * (1.0 + c * 0.18) / (1.0 + c * 0.42);
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
)GLSL";

}  // namespace

std::string plain_body_vertex() {
  return R"GLSL(
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in vec3 a_look;    // scalar, cavity, 1 fixed, -1 wall or 2 thread
layout(location = 3) in vec3 a_strain;  // of the triangle's edge across from each corner
layout(location = 4) in float a_body;
uniform mat4 u_view_projection;
out vec3 v_edge;
centroid out vec3 v_position, v_normal, v_look;
flat out vec3 v_strain;
flat out float v_body;
void main() {
  int corner = gl_VertexID % 3;
  v_edge = vec3(corner == 0, corner == 1, corner == 2);
  v_position = a_position;
  v_normal = a_normal;
  v_look = a_look;
  v_strain = a_strain;
  v_body = a_body;
  gl_Position = u_view_projection * vec4(v_position, 1.0);
}
)GLSL";
}

std::string curved_body_vertex() {
  return R"GLSL(
layout(location = 0) in vec3 a_p0;
layout(location = 1) in vec3 a_n0;
layout(location = 2) in vec3 a_look0;
layout(location = 3) in vec3 a_strain;
layout(location = 4) in vec3 a_p1;
layout(location = 5) in vec3 a_n1;
layout(location = 6) in vec3 a_look1;
layout(location = 7) in vec3 a_p2;
layout(location = 8) in vec3 a_n2;
layout(location = 9) in vec3 a_look2;
layout(location = 10) in vec3 a_weight;
layout(location = 11) in float a_body;
uniform mat4 u_view_projection;
out vec3 v_edge;
centroid out vec3 v_position, v_normal, v_look;
flat out vec3 v_strain;
flat out float v_body;
// Curved point-normal triangles: A. Vlachos et al., I3D 2001. They pass through the body's own vertices.
vec3 inner(vec3 from, vec3 to, vec3 n) { return (2.0 * from + to - dot(to - from, n) * n) / 3.0; }
vec3 middle(vec3 p, vec3 q, vec3 n, vec3 m) {
  vec3 e = q - p;
  return normalize(n + m - 2.0 * dot(e, n + m) / max(dot(e, e), 1e-20) * e);
}
void main() {
  float u = a_weight.x, v = a_weight.y, w = a_weight.z;
  vec3 b210 = inner(a_p0, a_p1, a_n0), b120 = inner(a_p1, a_p0, a_n1);
  vec3 b021 = inner(a_p1, a_p2, a_n1), b012 = inner(a_p2, a_p1, a_n2);
  vec3 b102 = inner(a_p2, a_p0, a_n2), b201 = inner(a_p0, a_p2, a_n0);
  vec3 e = (b210 + b120 + b021 + b012 + b102 + b201) / 6.0, c = (a_p0 + a_p1 + a_p2) / 3.0;
  v_position = a_p0 * (u * u * u) + a_p1 * (v * v * v) + a_p2 * (w * w * w) +
               3.0 * (b210 * (u * u * v) + b120 * (u * v * v) + b021 * (v * v * w) + b012 * (v * w * w) + b102 * (u * w * w) +
                      b201 * (u * u * w)) + 6.0 * (1.5 * e - 0.5 * c) * (u * v * w);
  v_normal = a_n0 * (u * u) + a_n1 * (v * v) + a_n2 * (w * w) + middle(a_p0, a_p1, a_n0, a_n1) * (u * v) +
             middle(a_p1, a_p2, a_n1, a_n2) * (v * w) + middle(a_p2, a_p0, a_n2, a_n0) * (u * w);
  v_edge = a_weight;
  v_look = a_look0 * u + a_look1 * v + a_look2 * w;
  v_strain = a_strain;
  v_body = a_body;
  gl_Position = u_view_projection * vec4(v_position, 1.0);
}
)GLSL";
}

std::string body_fragment(int lines) {
  return "#define LINES " + std::to_string(lines) + "\n" + kShadow + kStudio + R"GLSL(
in vec3 v_edge;
centroid in vec3 v_position, v_normal, v_look;
flat in vec3 v_strain;
flat in float v_body;
uniform sampler2D u_colors;
uniform float u_color_max, u_contour, u_floor_z, u_size, u_bias, u_strain_max, u_line;
uniform vec3 u_held, u_wall, u_thread;
uniform vec3 u_bodies[8];  // of several, else unused
uniform int u_several;
uniform vec3 u_pushed, u_slack, u_pulled;  // StrainColors
out vec4 color;
void main() {
  float scalar = v_look.x, cavity = v_look.y, fixed_share = v_look.z;
  vec3 n = normalize(v_normal) * (gl_FrontFacing ? 1.0 : -1.0);
  vec3 albedo = texture(u_colors, vec2(scalar / u_color_max * (255.0 / 256.0) + 0.5 / 256.0, 0.5)).rgb;
  // Bodies have their own colours where they have hardly moved, and a tinge of them elsewhere.
  if (u_several != 0) albedo = mix(u_bodies[int(v_body + 0.5)], albedo, 0.7 * smoothstep(0.02, 0.4, scalar / u_color_max));
  // What is held fast: slate, softly from the first free vertex on: the border between vertices is nobody's.
  albedo = mix(albedo, u_held, 0.82 * smoothstep(0.0, 1.0, fixed_share));
  albedo = mix(albedo, u_wall, 0.8 * step(0.5, -fixed_share));
  // A line at each step of the legend, not at zero: of an indentation they are its lines of equal depth.
  float steps = scalar / u_contour, across = max(fwidth(steps), 1e-6) * u_line;
  float contour = 1.0 - smoothstep(0.5, 1.5, abs(fract(steps - 0.5) - 0.5) / across);
  bool thread = fixed_share > 1.5;
  albedo *= 1.0 - 0.42 * contour * step(0.5, steps) * (1.0 - smoothstep(0.2, 0.6, across));
  if (thread) albedo = u_thread;
  float open = thread ? 1.0 : clamp(1.0 - 1.3 * cavity, 0.45, 1.08);
  open *= mix(0.62 + 0.38 * clamp(n.z, 0.0, 1.0), 1.0, smoothstep(0.0, 0.30, (v_position.z - u_floor_z) / u_size));
  float lit = lit_fraction(u_key_map, u_key_matrix, v_position + u_bias * (n + 0.6 * u_key_direction), 0.010, grain());
  lit *= min(1.0, 0.5 + 0.5 * open);  // the key light is as wide as a window: an indentation hides a part of it too
  vec3 c = studio(albedo, n, v_position, 1.0, 0.42, open, lit);
#if LINES > 0  // Lines
  vec3 w = u_line * fwidth(v_edge), near = smoothstep((LINES == 2 ? 0.7 : 0.4) * w, (LINES == 2 ? 1.7 : 1.3) * w, v_edge);
  float edge = 1.0 - min(near.x, min(near.y, near.z));
#endif
#if LINES == 1
  c = mix(c, c * 0.25, edge);
#elif LINES == 2
  float strain = near.x < min(near.y, near.z) ? v_strain.x : near.y < near.z ? v_strain.y : v_strain.z;
  float s = clamp(strain / u_strain_max, -1.0, 1.0);
  float share = sqrt(abs(s));  // an edge at rest is hardly there
  c = mix(c, mix(u_slack, s < 0.0 ? u_pushed : u_pulled, share), edge * mix(0.08, 1.0, smoothstep(0.0, 0.3, abs(s))));
#endif
  color = vec4(develop(c), 1.0);
}
)GLSL";
}

std::string solid_vertex() {
  return R"GLSL(
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in vec3 a_color;
layout(location = 3) in float a_gloss;
uniform mat4 u_view_projection;
centroid out vec3 v_position, v_normal, v_color;
centroid out float v_gloss;
void main() {
  v_position = a_position;
  v_normal = a_normal;
  v_color = a_color;
  v_gloss = a_gloss;
  gl_Position = u_view_projection * vec4(a_position, 1.0);
}
)GLSL";
}

std::string solid_fragment() {
  return std::string(kStudio) + R"GLSL(
centroid in vec3 v_position, v_normal, v_color;
centroid in float v_gloss;
out vec4 color;
void main() { color = vec4(develop(studio(v_color, normalize(v_normal), v_position, 0.0, v_gloss, 1.0, 1.0)), 1.0); }
)GLSL";
}

std::string floor_vertex() {
  return R"GLSL(
uniform mat4 u_view_projection;
uniform vec3 u_center;
uniform float u_reach;
out vec3 v_position;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  v_position = u_center + vec3(corner * u_reach, 0.0);
  gl_Position = u_view_projection * vec4(v_position, 1.0);
}
)GLSL";
}

// In floor coordinates and few pixels: wide penumbrae need many taps but little resolution.
std::string floor_shadow_fragment() {
  return std::string(kShadow) + R"GLSL(
in vec2 v_at;
uniform sampler2DShadow u_sky_map;
uniform mat4 u_sky_matrix;
uniform vec3 u_center;
uniform float u_reach;
out vec4 color;
void main() {
  vec3 p = u_center + vec3((v_at * 2.0 - 1.0) * u_reach, 0.0);
  float key = 1.0 - lit_fraction(u_key_map, u_key_matrix, p, 0.022, 0.0);
  float sky = 1.0 - lit_fraction(u_sky_map, u_sky_matrix, p, 0.070, 0.0);
  color = vec4(1.0 - (1.0 - 0.72 * key) * (1.0 - 0.62 * sky));
}
)GLSL";
}

// Effect of the floor on the background: darker where light is hidden, and a faint grid as a ruler.
std::string floor_fragment() {
  return R"GLSL(
in vec3 v_position;
uniform sampler2D u_shadow;
uniform vec3 u_center, u_grid;
uniform float u_reach, u_spacing, u_grid_strength, u_shadow_strength, u_line;
out vec4 color;
void main() {
  vec2 off = (v_position.xy - u_center.xy) / u_reach;
  float far = length(off);
  float shadow = u_shadow_strength * texture(u_shadow, off * 0.5 + 0.5).r * (1.0 - smoothstep(0.7, 1.0, far));
  vec2 g = v_position.xy / u_spacing, w = u_line * fwidth(g);
  vec2 d = abs(fract(g - 0.5) - 0.5);
  vec2 on = (1.0 - smoothstep(0.3 * w, 1.3 * w, d)) * clamp(0.25 / w, 0.0, 1.0);
  float line = u_grid_strength * max(on.x, on.y) * (1.0 - smoothstep(0.25, 0.85, far));
  color = vec4(u_grid * line * (1.0 - shadow), 1.0 - (1.0 - shadow) * (1.0 - line));
}
)GLSL";
}

std::string background_vertex() {
  return R"GLSL(
out vec2 v_at;
void main() {
  v_at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(v_at * 2.0 - 1.0, 0.0, 1.0);
}
)GLSL";
}

std::string background_fragment() {
  return R"GLSL(
in vec2 v_at;
uniform vec3 u_top, u_bottom;
out vec4 color;
void main() {
  vec3 c = mix(u_bottom, u_top, smoothstep(0.0, 1.0, v_at.y));
  vec2 off = v_at - vec2(0.5, 0.45);
  c *= 1.0 - 0.22 * smoothstep(0.25, 0.85, length(off));
  // Half a grey level of noise hides the steps of a dark gradient.
  float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))) - 0.5;
  color = vec4(c + noise / 255.0, 1.0);
}
)GLSL";
}

std::string depth_fragment() { return "void main() {}\n"; }

}  // namespace palpate::shaders
