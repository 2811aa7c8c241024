// Orbit camera: turn, slide and zoom with mouse and touch, and preset views.

export const PRESETS = {  // radians
  corner: { yaw: 1.0, pitch: 0.21 }, front: { yaw: 0, pitch: 0.08 }, side: { yaw: -Math.PI / 2, pitch: 0.08 },
  back: { yaw: Math.PI, pitch: 0.12 }, above: { yaw: 0, pitch: 1.45 },
};
const MIN_DISTANCE_M = 1.2;
const MAX_DISTANCE_M = 14;
const TURN_RAD_PER_PX = [0.006, 0.005];
const SLIDE_PER_PX = 0.0011;  // of the distance
const ZOOM_PER_PX = 0.0015;
const KEY_PX = 24;  // of the pointer that one press of an arrow key stands for
const KEY_ZOOM = 1.1;
const FOLLOW_SHARE = 0.06;  // of the way to the person that the look-at point moves with every pose
const MAX_WHEEL_PX = 120;  // of one wheel event
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

export function orbitControls(scene) {
  const { canvas, eye } = scene;
  const pointers = new Map();
  let distance = 0;  // of two fingers
  const turn = (dx, dy) => {
    eye.yaw -= dx * TURN_RAD_PER_PX[0];
    eye.pitch = clamp(eye.pitch + dy * TURN_RAD_PER_PX[1], -0.05, 1.5);
    scene.requestDraw();
  };
  const slide = (dx, dy) => {
    controls.follows = false;
    const step = eye.distance * SLIDE_PER_PX;
    eye.target = [
      eye.target[0] - Math.cos(eye.yaw) * dx * step, clamp(eye.target[1] + dy * step, 0, 2.5),
      eye.target[2] + Math.sin(eye.yaw) * dx * step,
    ];
    scene.requestDraw();
  };
  const zoom = (by) => { eye.distance = clamp(eye.distance * by, MIN_DISTANCE_M, MAX_DISTANCE_M); scene.requestDraw(); };
  canvas.addEventListener('pointerdown', (e) => { pointers.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener('pointermove', (e) => {
    const before = pointers.get(e.pointerId);
    if (!before) return;
    const [dx, dy] = [e.clientX - before[0], e.clientY - before[1]];
    pointers.set(e.pointerId, [e.clientX, e.clientY]);
    if (pointers.size === 2) {
      const [a, b] = [...pointers.values()];
      const now = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (distance) zoom(distance / now);
      distance = now;
    } else if (e.shiftKey || e.buttons & 6) slide(dx, dy);
    else turn(dx, dy);
  });
  for (const end of ['pointerup', 'pointercancel'])
    canvas.addEventListener(end, (e) => { pointers.delete(e.pointerId); distance = 0; });
  canvas.addEventListener('wheel', (e) => { e.preventDefault(); zoom(Math.exp(clamp(e.deltaY, -MAX_WHEEL_PX, MAX_WHEEL_PX) * ZOOM_PER_PX)); }, { passive: false });
  canvas.addEventListener('contextmenu', (e) => e.preventDefault());
  canvas.addEventListener('keydown', (e) => {
    const turns = { ArrowLeft: [-KEY_PX, 0], ArrowRight: [KEY_PX, 0], ArrowUp: [0, -KEY_PX], ArrowDown: [0, KEY_PX] };
    if (e.key in turns && e.shiftKey) slide(...turns[e.key]);
    else if (e.key in turns) turn(...turns[e.key]);
    else if (e.key === '+' || e.key === '=') zoom(1 / KEY_ZOOM);
    else if (e.key === '-') zoom(KEY_ZOOM);
    else return;
    e.preventDefault();
    e.stopPropagation();
  });
  const controls = {
    follows: true,  // keep the person in the picture
    look(name) { Object.assign(eye, PRESETS[name]); controls.follows = true; scene.requestDraw(); },
    // Move the look-at point by a share of the way to a person, unless the picture was slid away.
    follow(position, share = FOLLOW_SHARE) {
      if (controls.follows) for (const axis of [0, 2]) eye.target[axis] += share * (position[axis] - eye.target[axis]);
    },
    turn, zoom,
  };
  return controls;
}
