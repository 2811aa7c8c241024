// The stage: floor, actor, cameras and trails, drawn with WebGL 2 whenever something has changed.
import { lookAt, minus, multiply, perspective, project } from './algebra.js';
import { Painter } from './painter.js';
import * as shaders from './shaders.js';

const HEIGHT = (38 * Math.PI) / 180;  // field of view
const MOST_SHADOWS = 20;
const SHADOW_PX = 128;
const SHADOW_M = 2.2;  // half the side of the square in which there are shadows
const LONGEST_MS = 2000;
const POINT_M = 0.011;
const POINT = [0.36, 0.92, 0.78, 0.95];
const SLOW_MS = 45;  // a picture that takes longer, again and again, is drawn with fewer pixels
const SCALES = [1, 0.75, 0.55, 0.4];

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = (this.gl = canvas.getContext('webgl2', { antialias: true, alpha: false }));
    if (!gl) throw new Error('this browser has no WebGL 2');
    this.eye = { target: [0, 0.95, 0], yaw: 1.0, pitch: 0.21, distance: 6 };
    this.layers = { floor: true, actor: true, cameras: true, silhouettes: true, trails: true, points: true };
    this.points = 0;
    this.capsules = [];
    this.lines = [];
    this.pictures = new Map();
    this.drawn = 0;
    this.waiting = false;
    this.shift = [0, 0];  // of the middle of the picture, in halves of the page, to what the panels leave free
    this.quality = 0;
    this.times = [];
    this.painter = new Painter(gl, {
      capsule: [shaders.CAPSULE_VERTEX, shaders.CAPSULE_FRAGMENT], floor: [shaders.FLOOR_VERTEX, shaders.FLOOR_FRAGMENT],
      shadow: [shaders.SHADOW_VERTEX, shaders.SHADOW_FRAGMENT], back: [shaders.BACK_VERTEX, shaders.BACK_FRAGMENT],
      line: [shaders.LINE_VERTEX, shaders.LINE_FRAGMENT], picture: [shaders.PICTURE_VERTEX, shaders.PICTURE_FRAGMENT],
      point: [shaders.POINT_VERTEX, shaders.POINT_FRAGMENT],
    });
    this.capsule = this.painter.capsuleMesh();
    this.square = this.painter.mesh(new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), [2]);
    this.ribbon = this.painter.mesh(new Float32Array(0), [3, 3, 2, 4]);
    this.cloud = this.painter.mesh(new Float32Array(0), [3]);
    this.sheet = this.painter.mesh(new Float32Array(0), [3, 2]);
    this.shadow = this.painter.target(SHADOW_PX);
    new ResizeObserver(() => this.changed()).observe(canvas);
  }

  // Draw with the next picture of the screen, once the one before is done: a slow machine skips some and stays responsive.
  changed() {
    this.stale = true;
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.stale = false;
      this.draw();
      const gl = this.gl;
      const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      gl.flush();
      this.done(fence, performance.now());
    });
  }

  done(fence, since) {
    const gl = this.gl;
    if (gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED && performance.now() - since < LONGEST_MS) {
      setTimeout(() => this.done(fence, since), 4);
      return;
    }
    gl.deleteSync(fence);
    this.waiting = false;
    this.pace(performance.now() - since);
    if (this.stale) this.changed();
  }

  // Fewer pixels where pictures take too long, as without a graphics card.
  pace(took) {
    this.times.push(took);
    if (this.times.length < 6) return;
    const usual = this.times.sort((x, y) => x - y)[2];
    this.times = [];
    if (usual > SLOW_MS && this.quality + 1 < SCALES.length) this.quality++;
  }

  get position() {
    const { target, yaw, pitch, distance } = this.eye;
    return [
      target[0] + distance * Math.cos(pitch) * Math.sin(yaw), target[1] + distance * Math.sin(pitch),
      target[2] + distance * Math.cos(pitch) * Math.cos(yaw),
    ];
  }

  get matrix() {
    const aspect = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight);
    const lens = perspective(HEIGHT, aspect, 0.05, 60);
    lens[8] = -this.shift[0];
    lens[9] = -this.shift[1];
    return multiply(lens, lookAt(this.position, this.eye.target));
  }

  // Where a point of the world is on the page, CSS pixels; null behind the eye.
  place(point) {
    const box = this.canvas.getBoundingClientRect();
    const at = project(this.matrix, point, box.width, box.height);
    return at && [at[0] + box.left, at[1] + box.top];
  }

  // picture: a canvas; corners: left top, right top, right bottom, left bottom, in the world.
  setPicture(name, picture, corners) {
    const gl = this.gl;
    let entry = this.pictures.get(name);
    if (!entry) this.pictures.set(name, (entry = { texture: gl.createTexture() }));
    entry.corners = corners;
    gl.bindTexture(gl.TEXTURE_2D, entry.texture);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, true);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    this.painter.smooth();
  }

  // places: x, y, z of each, metres.
  setPoints(places) {
    if (!this.points && !places.length) return;
    this.points = places.length / 3;
    this.painter.fill(this.cloud, places);
    this.changed();
  }

  draw() {
    const gl = this.gl;
    const scale = Math.min(window.devicePixelRatio || 1, 2) * SCALES[this.quality];
    if (this.layers.floor) this.drawShadow();
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight].map((px) => Math.max(1, Math.round(px * scale)));
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.disable(gl.DEPTH_TEST);
    this.painter.use('back', {});
    this.painter.fan(this.square, gl.TRIANGLE_STRIP, 4);
    const camera = this.matrix;
    if (this.layers.floor) this.drawFloor(camera);
    gl.enable(gl.DEPTH_TEST);
    if (this.layers.actor) this.drawActor(camera);
    gl.depthMask(false);
    if (this.layers.silhouettes) this.drawPictures(camera);
    if (this.layers.points && this.points) this.drawPoints(camera, height);
    this.drawLines(camera, width / scale, height / scale);
    gl.depthMask(true);
    this.drawn++;
  }

  // How much light the actor takes from the floor around it, as a small picture.
  drawShadow() {
    const gl = this.gl;
    const shown = this.layers.actor ? this.capsules.filter((c) => c.colour[3] === 1).slice(0, MOST_SHADOWS) : [];
    const ends = (pick) => new Float32Array(MOST_SHADOWS * 4).map((_, n) => (shown[n >> 2] ? pick(shown[n >> 2], n & 3) : 0));
    const radius = (c) => (Math.min(...c.near) + Math.min(...c.far)) / 2;
    this.middle = shown.length ? [shown[0].origin[0], shown[0].origin[2]] : [0, 0];
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadow.frame);
    gl.viewport(0, 0, SHADOW_PX, SHADOW_PX);
    gl.disable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    this.painter.use('shadow', {
      middle: this.middle, size: SHADOW_M, count: shown.length,
      'from[0]': ends((c, k) => (k < 3 ? c.origin[k] : 0)), 'to[0]': ends((c, k) => (k < 3 ? c.end[k] : radius(c))),
    });
    this.painter.fan(this.square, gl.TRIANGLE_STRIP, 4);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  drawFloor(camera) {
    const gl = this.gl;
    this.painter.use('floor', { camera, size: 10, middle: this.middle, reach: SHADOW_M, shadow: 0 });
    gl.bindTexture(gl.TEXTURE_2D, this.shadow.texture);
    this.painter.fan(this.square, gl.TRIANGLE_STRIP, 4);
  }

  drawActor(camera) {
    const gl = this.gl;
    gl.enable(gl.CULL_FACE);
    for (const one of this.capsules) {
      this.painter.use('capsule', {
        camera, eye: this.position, origin: one.origin, turn: one.turn, near: one.near, far: one.far, reach: one.reach,
        caps: one.caps, colour: one.colour,
      });
      gl.bindVertexArray(this.capsule.array);
      gl.drawElements(gl.TRIANGLES, this.capsule.count, gl.UNSIGNED_SHORT, 0);
    }
    gl.disable(gl.CULL_FACE);
  }

  drawPictures(camera) {
    const gl = this.gl;
    const far = [...this.pictures.values()].sort((a, b) => this.away(b) - this.away(a));
    for (const { texture, corners } of far) {
      this.painter.use('picture', { camera, picture: 0, strength: 0.85 });
      gl.bindTexture(gl.TEXTURE_2D, texture);
      const [a, b, c, d] = corners;
      this.painter.fill(this.sheet, new Float32Array([...a, 0, 0, ...b, 1, 0, ...d, 0, 1, ...c, 1, 1]));
      this.painter.fan(this.sheet, gl.TRIANGLE_STRIP, 4);
    }
  }

  drawPoints(camera, height) {
    this.painter.use('point', { camera, size: POINT_M * height / Math.tan(HEIGHT / 2), colour: POINT });
    this.painter.fan(this.cloud, this.gl.POINTS, this.points);
  }

  away({ corners }) { return Math.hypot(...minus(corners[0], this.position)); }

  // Each line is {from, to, width, colour, layer}.
  drawLines(camera, width, height) {
    const out = [];
    for (const { from, to, width: px, fade, colour, layer } of this.lines) {
      if (!this.layers[layer]) continue;
      const old = [colour[0], colour[1], colour[2], fade === undefined ? colour[3] : fade];
      const corner = (a, b, side, way, tint) => out.push(...a, ...b, side, way, ...tint);
      corner(from, to, 1, px, old); corner(from, to, 1, -px, old); corner(to, from, -1, px, colour);
      corner(from, to, 1, -px, old); corner(to, from, -1, -px, colour); corner(to, from, -1, px, colour);
    }
    if (!out.length) return;
    this.painter.use('line', { camera, screen: [width, height] });
    this.painter.fill(this.ribbon, new Float32Array(out));
    this.painter.fan(this.ribbon, this.gl.TRIANGLES, out.length / 12);
  }
}
