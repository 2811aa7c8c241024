// Shaders of the scene.  Colours are computed in linear light and written as sRGB.

const LIGHT = `
const vec3 KEY = vec3(0.42, 0.83, 0.37);
vec3 srgb(vec3 c) { return pow(clamp(c, 0.0, 1.0), vec3(1.0 / 2.2)); }
`;

// Tapered capsule with elliptic cross-sections.  ring: cos and sin around the axis.  row: which end, cos and sin of the cap.
export const CAPSULE_VERTEX = `#version 300 es
layout(location=0) in vec2 ring; layout(location=1) in vec3 row;
uniform mat4 camera; uniform vec3 origin; uniform vec4 rotation; uniform vec2 near, far; uniform float axis; uniform vec2 caps;
out vec3 normal; out vec3 at;
vec3 rotated(vec3 v) { return v + 2.0 * cross(rotation.xyz, cross(rotation.xyz, v) + rotation.w * v); }
void main() {
  vec2 radius = mix(near, far, row.x);
  float cap = mix(caps.x, caps.y, row.x);
  vec3 local = vec3(radius.x * row.y * ring.x, row.x * axis + row.z * cap, radius.y * row.y * ring.y);
  float slope = (near.x - far.x + near.y - far.y) / (2.0 * max(axis, 0.001));
  vec3 out_ward = vec3(row.y * ring.x / radius.x, row.z / cap, row.y * ring.y / radius.y);
  out_ward = normalize(out_ward) + vec3(0.0, slope * row.y, 0.0);
  normal = rotated(normalize(out_ward));
  at = origin + rotated(local);
  gl_Position = camera * vec4(at, 1.0);
}`;

export const CAPSULE_FRAGMENT = `#version 300 es
precision highp float;
in vec3 normal; in vec3 at; uniform vec3 eye; uniform vec4 colour; out vec4 pixel;
${LIGHT}
void main() {
  vec3 n = normalize(normal), v = normalize(eye - at), k = normalize(KEY);
  float key = max(dot(n, k), 0.0), wrap = max((dot(n, k) + 0.5) / 1.5, 0.0);
  vec3 ambient = mix(vec3(0.10, 0.11, 0.14), vec3(0.30, 0.35, 0.43), n.y * 0.5 + 0.5);
  float ground = smoothstep(0.0, 0.35, at.y) * 0.35 + 0.65;
  float shine = pow(max(dot(n, normalize(k + v)), 0.0), 48.0) * 0.22;
  float rim = pow(1.0 - max(dot(n, v), 0.0), 3.0) * (0.35 + 0.65 * max(n.y, 0.0)) * 0.38;
  vec3 base = pow(colour.rgb, vec3(2.2));
  vec3 lit = base * (ambient * ground + vec3(1.0, 0.95, 0.88) * (0.55 * key + 0.35 * wrap)) + shine + rim * vec3(0.55, 0.72, 1.0);
  pixel = vec4(srgb(lit) * colour.a, colour.a);
}`;

// Light on the floor: red: share of the key light, green: share of the sky hidden by capsules (from, to: ends; to.w: radius).
export const SHADOW_VERTEX = `#version 300 es
layout(location=0) in vec2 corner; uniform vec2 middle; uniform float size; out vec2 at;
void main() { at = middle + corner * size; gl_Position = vec4(corner, 0.0, 1.0); }`;

export const SHADOW_FRAGMENT = `#version 300 es
precision highp float;
in vec2 at; out vec4 pixel; uniform vec4 from[20], to[20]; uniform int count;
${LIGHT}
float shade(vec3 p, vec3 ray, vec3 a, vec3 b, float r) {
  vec3 ba = b - a, oa = p - a;
  float oad = dot(oa, ray), dba = dot(ray, ba), baba = max(dot(ba, ba), 1e-6), oaba = dot(oa, ba);
  vec2 th = vec2(-oad * baba + dba * oaba, oaba - oad * dba) / max(baba - dba * dba, 1e-6);
  th.x = max(th.x, 0.0001); th.y = clamp(th.y, 0.0, 1.0);
  float d = length(p + ray * th.x - (a + ba * th.y)) - r;
  float s = clamp(9.0 * d / th.x + 0.5, 0.0, 1.0);
  return s * s * (3.0 - 2.0 * s);
}
void main() {
  vec3 p = vec3(at.x, 0.0, at.y), ray = normalize(KEY);
  float lit = 1.0, sky = 0.0;
  for (int k = 0; k < count; k++) {
    lit = min(lit, shade(p, ray, from[k].xyz, to[k].xyz, to[k].w));
    vec3 ba = to[k].xyz - from[k].xyz;
    float h = clamp(dot(p - from[k].xyz, ba) / max(dot(ba, ba), 1e-6), 0.0, 1.0);
    float s = to[k].w / (to[k].w + length(p - from[k].xyz - ba * h));
    sky = max(sky, s * s);
  }
  pixel = vec4(lit, sky, 0.0, 1.0);
}`;

// Floor: a grid that fades with the distance, with that shadow on it.
export const FLOOR_VERTEX = `#version 300 es
layout(location=0) in vec2 corner; uniform mat4 camera; uniform float size; out vec2 at;
void main() { at = corner * size; gl_Position = camera * vec4(at.x, 0.0, at.y, 1.0); }`;

export const FLOOR_FRAGMENT = `#version 300 es
precision highp float;
in vec2 at; out vec4 pixel; uniform vec2 middle; uniform float reach; uniform float light; uniform sampler2D shadow;
${LIGHT}
float line(float x, float step, float width) {
  float d = abs(fract(x / step - 0.5) - 0.5) * step, w = fwidth(x);
  return (1.0 - smoothstep(width, width + 1.4 * w, d)) * clamp(2.0 * width / max(w, 1e-5), 0.25, 1.0);
}
void main() {
  float away = length(at - middle * 0.35);
  float fade = 1.0 - smoothstep(1.5, 6.5, away);
  vec3 base = mix(vec3(0.010, 0.015, 0.024), vec3(0.075, 0.096, 0.130), exp(-away * away * 0.09));
  float fine = max(line(at.x, 0.25, 0.0016), line(at.y, 0.25, 0.0016)) * 0.22;
  float coarse = max(line(at.x, 1.0, 0.0035), line(at.y, 1.0, 0.0035)) * 0.6;
  base = mix(base, mix(vec3(0.74, 0.78, 0.83), vec3(0.86, 0.88, 0.91), exp(-away * away * 0.09)), light);
  vec3 c = base + fade * max(fine, coarse) * mix(vec3(0.15, 0.20, 0.27), vec3(-0.30, -0.28, -0.25), light);
  vec2 spot = (at - middle) / reach;
  float inside = 1.0 - smoothstep(0.8, 1.0, max(abs(spot.x), abs(spot.y)));
  vec2 taken = texture(shadow, spot * 0.5 + 0.5).rg;
  c *= mix(1.0, (0.42 + 0.58 * taken.r) * (1.0 - 0.75 * taken.g), inside);
  pixel = vec4(srgb(c), 1.0) * (1.0 - smoothstep(6.0, 9.5, away));
}`;

export const BACK_VERTEX = `#version 300 es
layout(location=0) in vec2 corner; out vec2 at; void main() { at = corner; gl_Position = vec4(corner, 0.9999, 1.0); }`;

export const BACK_FRAGMENT = `#version 300 es
precision highp float; in vec2 at; out vec4 pixel; uniform float light;
void main() {
  float glow = exp(-dot(at - vec2(0.0, 0.1), at - vec2(0.0, 0.1)) * 1.1);
  vec3 c = mix(vec3(0.043, 0.059, 0.086), vec3(0.125, 0.160, 0.212), glow);
  c = mix(c, mix(vec3(0.84, 0.87, 0.91), vec3(0.95, 0.96, 0.975), glow), light);
  float noise = fract(sin(dot(gl_FragCoord.xy, vec2(12.9898, 78.233))) * 43758.5453) / 255.0;
  pixel = vec4(c + noise, 1.0);
}`;

// Lines with a width in pixels: each vertex has both ends of its line.
export const LINE_VERTEX = `#version 300 es
layout(location=0) in vec3 here; layout(location=1) in vec3 there; layout(location=2) in vec2 side; layout(location=3) in vec4 tint;
uniform mat4 camera; uniform vec2 screen; out vec4 colour;
void main() {
  vec4 a = camera * vec4(here, 1.0), b = camera * vec4(there, 1.0);
  vec2 along = (b.xy / max(b.w, 0.01) - a.xy / max(a.w, 0.01)) * screen;
  along = along / max(length(along), 1e-4) * sign(side.x);
  a.xy += vec2(-along.y, along.x) * abs(side.x) * side.y / screen * a.w;
  colour = tint; gl_Position = a;
}`;

export const LINE_FRAGMENT = `#version 300 es
precision highp float; in vec4 colour; out vec4 pixel; void main() { pixel = vec4(colour.rgb * colour.a, colour.a); }`;

// Points of one world size, as soft discs.
export const POINT_VERTEX = `#version 300 es
layout(location=0) in vec3 place; uniform mat4 camera; uniform float size;
void main() { gl_Position = camera * vec4(place, 1.0); gl_PointSize = clamp(size / gl_Position.w, 1.5, 16.0); }`;

export const POINT_FRAGMENT = `#version 300 es
precision highp float; uniform vec4 colour; out vec4 pixel;
void main() { pixel = colour * (1.0 - smoothstep(0.7, 1.0, 2.0 * length(gl_PointCoord - 0.5))); }`;

// Picture on four corners in the world, such as a camera's view.
export const PICTURE_VERTEX = `#version 300 es
layout(location=0) in vec3 place; layout(location=1) in vec2 spot; uniform mat4 camera; out vec2 at;
void main() { at = spot; gl_Position = camera * vec4(place, 1.0); }`;

export const PICTURE_FRAGMENT = `#version 300 es
precision highp float; in vec2 at; uniform sampler2D picture; uniform float strength; out vec4 pixel;
void main() { pixel = texture(picture, at) * strength; }`;
