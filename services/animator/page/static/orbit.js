// Looking around with mouse, touch and keys; and the ready-made looks.

export const LOOKS = {
  corner: { yaw: 1.0, pitch: 0.21 }, front: { yaw: 0, pitch: 0.08 }, side: { yaw: -Math.PI / 2, pitch: 0.08 },
  back: { yaw: Math.PI, pitch: 0.12 }, above: { yaw: 0, pitch: 1.45 },
};
const NEAREST = 1.2;
const FARTHEST = 14;
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

export function orbit(stage) {
  const { canvas, eye } = stage;
  const held = new Map();
  let apart = 0;
  const turn = (dx, dy) => {
    eye.yaw -= dx * 0.006;
    eye.pitch = clamp(eye.pitch + dy * 0.005, -0.05, 1.5);
    stage.changed();
  };
  const slide = (dx, dy) => {
    look.follows = false;
    const step = eye.distance * 0.0011;
    eye.target = [
      eye.target[0] - Math.cos(eye.yaw) * dx * step, clamp(eye.target[1] + dy * step, 0, 2.5),
      eye.target[2] + Math.sin(eye.yaw) * dx * step,
    ];
    stage.changed();
  };
  const zoom = (by) => { eye.distance = clamp(eye.distance * by, NEAREST, FARTHEST); stage.changed(); };
  canvas.addEventListener('pointerdown', (e) => { held.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener('pointermove', (e) => {
    const before = held.get(e.pointerId);
    if (!before) return;
    const [dx, dy] = [e.clientX - before[0], e.clientY - before[1]];
    held.set(e.pointerId, [e.clientX, e.clientY]);
    if (held.size === 2) {
      const [a, b] = [...held.values()];
      const now = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (apart) zoom(apart / now);
      apart = now;
    } else if (e.shiftKey || e.buttons & 6) slide(dx, dy);
    else turn(dx, dy);
  });
  for (const end of ['pointerup', 'pointercancel'])
    canvas.addEventListener(end, (e) => { held.delete(e.pointerId); apart = 0; });
  canvas.addEventListener('wheel', (e) => { e.preventDefault(); zoom(Math.exp(clamp(e.deltaY, -120, 120) * 0.0015)); }, { passive: false });
  canvas.addEventListener('contextmenu', (e) => e.preventDefault());
  const look = {
    follows: true,  // the person, who would walk out of the picture
    look(name) { Object.assign(eye, LOOKS[name]); look.follows = true; stage.changed(); },
    turn, zoom,
  };
  return look;
}
