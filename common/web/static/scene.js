// 3D scene: floor, virtual actor, cameras and trails, drawn with WebGL 2 when something has changed.
import { lookAt, minus, multiply, perspective, project } from './linear_algebra.js';
import { Renderer } from './webgl.js';
import * as shaders from './shaders.js';

const FIELD_OF_VIEW = (38 * Math.PI) / 180;  // vertical, radians
const MAX_SHADOWS = 20;  // capsules that cast one; the size of the arrays in the shader
const SHADOW_PX = 128;
const SHADOW_M = 2.2;  // half the side of the square with shadows
const DRAW_TIMEOUT_MS = 2000;  // for the graphics card to finish a picture
const POINT_M = 0.011;
const POINT_COLOUR = [0.36, 0.92, 0.78, 0.95];
const SLOW_MS = 45;  // median drawing time above which fewer pixels are drawn
const FAST_MS = 20;  // expected drawing time below which more are drawn again
const TIMED_PICTURES = 4;  // over which the median is taken
const SCALES = [1, 0.75, 0.55, 0.4];  // of the resolution, in steps

export class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = (this.gl = canvas.getContext('webgl2', { antialias: true, alpha: false }));
    if (!gl) throw new Error('this browser has no WebGL 2');
    this.eye = { target: [0, 0.95, 0], yaw: 1.0, pitch: 0.21, distance: 6 };
    this.layers = { floor: true, axes: true, actor: true, cameras: true, silhouettes: true, trails: true, points: true };
    this.points = 0;
    this.capsules = [];
    this.ghost = [];  // capsules of a second take, translucent, without a shadow
    this.lines = [];
    this.pictures = new Map();
    this.drawn = 0;
    this.waiting = false;
    this.shift = [0, 0];  // of the centre of the picture to the area free of panels, in halves of the page
    this.quality = 0;  // index of SCALES
    this.pauseMs = 0;  // after each picture
    this.times = [];
    this.renderer = new Renderer(gl, {
      capsule: [shaders.CAPSULE_VERTEX, shaders.CAPSULE_FRAGMENT], floor: [shaders.FLOOR_VERTEX, shaders.FLOOR_FRAGMENT],
      shadow: [shaders.SHADOW_VERTEX, shaders.SHADOW_FRAGMENT], back: [shaders.BACK_VERTEX, shaders.BACK_FRAGMENT],
      line: [shaders.LINE_VERTEX, shaders.LINE_FRAGMENT], picture: [shaders.PICTURE_VERTEX, shaders.PICTURE_FRAGMENT],
      point: [shaders.POINT_VERTEX, shaders.POINT_FRAGMENT],
    });
    this.capsule = this.renderer.capsuleMesh();
    this.square = this.renderer.mesh(new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), [2]);
    this.ribbon = this.renderer.mesh(new Float32Array(0), [3, 3, 2, 4]);
    this.cloud = this.renderer.mesh(new Float32Array(0), [3]);
    this.sheet = this.renderer.mesh(new Float32Array(0), [3, 2]);
    this.shadow = this.renderer.target(SHADOW_PX);
    new ResizeObserver(() => this.requestDraw()).observe(canvas);
    const room = matchMedia('(prefers-color-scheme: light)');
    const showRoom = () => { this.light = Number(room.matches); this.requestDraw(); };  // 1 in a light room
    room.addEventListener('change', showRoom);
    showRoom();
  }

  // Draw at the next screen refresh after the last drawing has finished: a slow machine skips pictures and stays responsive.
  requestDraw() {
    this.stale = true;
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.stale = false;
      this.draw();
      const gl = this.gl;
      const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      gl.flush();
      this.awaitDrawn(fence, performance.now());
    });
  }

  awaitDrawn(fence, since) {
    const gl = this.gl;
    if (gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED && performance.now() - since < DRAW_TIMEOUT_MS) {
      setTimeout(() => this.awaitDrawn(fence, since), 4);
      return;
    }
    gl.deleteSync(fence);
    this.adaptResolution(performance.now() - since);
    if (this.pauseMs) setTimeout(() => this.endPicture(), this.pauseMs);
    else this.endPicture();
  }

  endPicture() {
    this.waiting = false;
    if (this.stale) this.requestDraw();
  }

  // Draw fewer pixels where drawing takes too long, for example without a graphics card; more again where it does not.
  adaptResolution(tookMs) {
    this.times.push(tookMs);
    if (this.times.length < TIMED_PICTURES) return;
    const medianMs = this.times.sort((x, y) => x - y)[(TIMED_PICTURES >> 1) - 1];
    this.times = [];
    // The time is nearly that of the pixels.
    const expectedMs = (k) => medianMs * (SCALES[k] / SCALES[this.quality]) ** 2;
    if (medianMs > SLOW_MS) {
      const found = SCALES.findIndex((_, k) => k > this.quality && expectedMs(k) <= SLOW_MS);
      this.quality = found < 0 ? SCALES.length - 1 : found;
    } else if (this.quality && expectedMs(this.quality - 1) <= FAST_MS) this.quality--;
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
    const projection = perspective(FIELD_OF_VIEW, aspect, 0.05, 60);
    projection[8] = -this.shift[0];
    projection[9] = -this.shift[1];
    return multiply(projection, lookAt(this.position, this.eye.target));
  }

  // Position of a world point on the page, CSS pixels; null behind the camera.
  toPage(point) {
    const box = this.canvas.getBoundingClientRect();
    const at = project(this.matrix, point, box.width, box.height);
    return at && [at[0] + box.left, at[1] + box.top];
  }

  // bare: canvas with silhouette and outlines, transparent elsewhere.  whole: with the camera's picture; may be `bare`.
  // corners: top left, top right, bottom right, bottom left, in the world.  Canvases are read when the scene is drawn.
  setPicture(name, bare, whole, corners) {
    let entry = this.pictures.get(name);
    if (!entry) this.pictures.set(name, (entry = { texture: this.gl.createTexture() }));
    Object.assign(entry, { bare, whole, corners, shown: null });
  }

  // The canvas of a view: one between eye and person must not hide the person.
  canvasOf({ bare, whole, corners }) {
    const middle = [0, 1, 2].map((k) => (corners[0][k] + corners[2][k]) / 2);
    return Math.hypot(...minus(middle, this.position)) < this.eye.distance ? bare : whole;
  }

  // Texture of a view with its newest picture.
  textureOf(entry) {
    const gl = this.gl;
    const canvas = this.canvasOf(entry);
    gl.bindTexture(gl.TEXTURE_2D, entry.texture);
    if (entry.shown === canvas) return;
    entry.shown = canvas;
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, true);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, canvas);
    this.renderer.setLinearFilter();
  }

  // positions: x, y, z of each point, metres.
  setPoints(positions) {
    if (!this.points && !positions.length) return;
    this.points = positions.length / 3;
    this.renderer.fill(this.cloud, positions);
    this.requestDraw();
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
    this.renderer.use('back', { light: this.light });
    this.renderer.draw(this.square, gl.TRIANGLE_STRIP, 4);
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

  // Draw the light that reaches the floor around the actor into a small texture.
  drawShadow() {
    const gl = this.gl;
    const shown = this.layers.actor ? this.capsules.filter((c) => c.colour[3] === 1).slice(0, MAX_SHADOWS) : [];
    const ends = (pick) => new Float32Array(MAX_SHADOWS * 4).map((_, n) => (shown[n >> 2] ? pick(shown[n >> 2], n & 3) : 0));
    const radius = (c) => (Math.min(...c.near) + Math.min(...c.far)) / 2;
    this.middle = shown.length ? [shown[0].origin[0], shown[0].origin[2]] : [0, 0];
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadow.frame);
    gl.viewport(0, 0, SHADOW_PX, SHADOW_PX);
    gl.disable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    this.renderer.use('shadow', {
      middle: this.middle, size: SHADOW_M, count: shown.length,
      'from[0]': ends((c, k) => (k < 3 ? c.origin[k] : 0)), 'to[0]': ends((c, k) => (k < 3 ? c.end[k] : radius(c))),
    });
    this.renderer.draw(this.square, gl.TRIANGLE_STRIP, 4);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  drawFloor(camera) {
    const gl = this.gl;
    this.renderer.use('floor', { camera, size: 10, middle: this.middle, reach: SHADOW_M, light: this.light, shadow: 0 });
    gl.bindTexture(gl.TEXTURE_2D, this.shadow.texture);
    this.renderer.draw(this.square, gl.TRIANGLE_STRIP, 4);
  }

  drawActor(camera) {
    const gl = this.gl;
    gl.enable(gl.CULL_FACE);
    for (const one of [...this.capsules, ...this.ghost]) {
      this.renderer.use('capsule', {
        camera, eye: this.position, origin: one.origin, rotation: one.rotation, near: one.near, far: one.far, axis: one.length,
        caps: one.caps, colour: one.colour,
      });
      gl.bindVertexArray(this.capsule.array);
      gl.drawElements(gl.TRIANGLES, this.capsule.count, gl.UNSIGNED_SHORT, 0);
    }
    gl.disable(gl.CULL_FACE);
  }

  drawPictures(camera) {
    const gl = this.gl;
    const far = [...this.pictures.values()].sort((a, b) => this.distance(b) - this.distance(a));
    for (const entry of far) {
      this.renderer.use('picture', { camera, picture: 0, strength: 0.85 });
      this.textureOf(entry);
      const [a, b, c, d] = entry.corners;
      this.renderer.fill(this.sheet, new Float32Array([...a, 0, 0, ...b, 1, 0, ...d, 0, 1, ...c, 1, 1]));
      this.renderer.draw(this.sheet, gl.TRIANGLE_STRIP, 4);
    }
  }

  drawPoints(camera, height) {
    this.renderer.use('point', { camera, size: POINT_M * height / Math.tan(FIELD_OF_VIEW / 2), colour: POINT_COLOUR });
    this.renderer.draw(this.cloud, this.gl.POINTS, this.points);
  }

  distance({ corners }) { return Math.hypot(...minus(corners[0], this.position)); }

  // Each line is {from, to, width (px), colour, layer} and, to fade, fromOpacity.
  drawLines(camera, width, height) {
    const out = [];
    for (const { from, to, width: px, fromOpacity, colour, layer } of this.lines) {
      if (!this.layers[layer]) continue;
      const fromColour = [colour[0], colour[1], colour[2], fromOpacity === undefined ? colour[3] : fromOpacity];
      const vertex = (a, b, end, side, tint) => out.push(...a, ...b, end, side, ...tint);
      vertex(from, to, 1, px, fromColour); vertex(from, to, 1, -px, fromColour); vertex(to, from, -1, px, colour);
      vertex(from, to, 1, -px, fromColour); vertex(to, from, -1, -px, colour); vertex(to, from, -1, px, colour);
    }
    if (!out.length) return;
    this.renderer.use('line', { camera, screen: [width, height] });
    this.renderer.fill(this.ribbon, new Float32Array(out));
    this.renderer.draw(this.ribbon, this.gl.TRIANGLES, out.length / 12);
  }
}
