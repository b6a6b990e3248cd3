"use strict";

const MOST = 64; // modes of a body

/** Where the points of a body are: an affine motion of the reference, and modes; in the last number the value of a field. */
const PLACE = `
uniform sampler2D reference;
uniform highp sampler2DArray modes, levels;
uniform mat4x3 affine;
uniform float amplitude[${MOST}], level[${MOST}];
uniform int modeCount, levelCount;
vec4 told(ivec2 at) {
  vec3 r = affine * vec4(texelFetch(reference, at, 0).xyz, 1.0);
  for (int m = 0; m < modeCount; m++) r += amplitude[m] * texelFetch(modes, ivec3(at, m), 0).xyz;
  float value = 0.0;
  for (int m = 0; m < levelCount; m++) value += level[m] * texelFetch(levels, ivec3(at, m), 0).x;
  return vec4(r, value);
}`;

const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
`;

/** Places of all points once an instant, into a texture of floats; what draws reads that. */
const COVER = `${HEAD}
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;
const FILL = `${HEAD}${PLACE}
out vec4 place;
void main() { place = told(ivec2(gl_FragCoord.xy)); }`;

/** `place(point)`: from that texture, or, where a card cannot draw into floats, of the modes again. */
const READ = (direct) => `${HEAD}
uniform int width;
${direct ? PLACE : "uniform sampler2D places;"}
vec4 place(uint point) {
  ivec2 at = ivec2(int(point) % width, int(point) / width);
  return ${direct ? "told(at)" : "texelFetch(places, at, 0)"};
}
uniform mat4 view;
uniform vec3 lift;
`;

/**
 * A tube, segment by segment: a prism around each, cut where it meets its neighbours half way. Every segment has a frame of its
 * own, so that no tube is twisted, however it bends; beyond 60 degrees a corner stays one.
 */
const TUBE = (direct) => `${READ(direct)}
layout(location = 0) in uvec4 run; // points: before a segment, its ends, behind it
layout(location = 1) in vec3 corner; // angle, end, and 1 on the disc that closes an end, 2 in its middle
uniform float radius;
out vec3 normal, spot;
out float value;
void main() {
  vec4 a = place(run.y), b = place(run.z);
  float size = max(length(b.xyz - a.xyz), 1e-20);
  vec3 along = (b.xyz - a.xyz) / size;
  bool last = corner.y > 0.5;
  uint beside = last ? run.w : run.x;
  vec3 other = last ? place(beside).xyz - b.xyz : a.xyz - place(beside).xyz;
  float way = length(other);
  vec3 mean = way > 0.0 && dot(other, along) > 0.5 * way ? normalize(along + other / way) : along;
  vec3 side = normalize(cross(along, abs(along.z) < 0.8 ? vec3(0, 0, 1) : vec3(1, 0, 0)));
  vec3 outward = cos(corner.x) * side + sin(corner.x) * cross(side, along);
  vec3 offset = radius * (outward - along * dot(outward, mean) / dot(along, mean));
  normal = corner.z > 0.5 ? (last ? along : -along) : normalize(outward - mean * dot(outward, mean));
  vec4 centre = last ? b : a;
  value = centre.w;
  spot = centre.xyz + lift + (corner.z > 1.5 ? vec3(0) : offset);
  gl_Position = view * vec4(spot, 1.0);
}`;

/** Facets, and the lines around them, which stand a little in front. */
const FACET = (direct) => `${READ(direct)}
layout(location = 0) in uint point;
uniform float nearer;
out vec3 normal, spot;
out float value;
void main() {
  vec4 here = place(point);
  value = here.w;
  normal = vec3(0);
  spot = here.xyz + lift;
  gl_Position = view * vec4(spot, 1.0);
  gl_Position.z -= nearer;
}`;

/** Joints, arrows and the grid: meshes with a place, a size and a direction. */
const MESH = `${HEAD}
layout(location = 0) in vec3 vertex;
layout(location = 1) in vec3 direction;
uniform mat4 view;
uniform mat3 turn;
uniform vec3 lift;
uniform float nearer;
out vec3 normal, spot;
out float value;
void main() {
  normal = turn * direction;
  spot = lift + turn * vertex;
  value = 0.0;
  gl_Position = view * vec4(spot, 1.0);
  gl_Position.z -= nearer;
}`;

/** Light from the eye and from above it; without a normal that of the facet, from the places around. */
const PAINT = `${HEAD}
in vec3 normal, spot;
in float value;
uniform vec4 paint;
uniform vec3 towards, above;
uniform vec2 limits;
uniform bool shaded, lit;
uniform sampler2D colours;
out vec4 colour;
void main() {
  vec3 base = paint.rgb;
  if (shaded) base = texture(colours, vec2((value - limits.x) / (limits.y - limits.x), 0.5)).rgb;
  if (lit) {
    vec3 n = dot(normal, normal) > 0.0 ? normal : cross(dFdx(spot), dFdy(spot));
    n = normalize(n);
    n = dot(n, towards) < 0.0 ? -n : n;
    float bright = 0.55 + 0.3 * dot(n, towards) + 0.2 * max(dot(n, above), 0.0);
    float gleam = 0.12 * pow(max(dot(n, normalize(towards + above)), 0.0), 24.0);
    base = base * bright + gleam;
  }
  colour = vec4(base * paint.a, paint.a);
}`;
