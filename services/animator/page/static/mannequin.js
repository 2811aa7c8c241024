// From a body and a pose, as the animator says them, to the capsules that are drawn.
import { add, rotate, times } from './algebra.js';

export const LEFT = [1.0, 0.62, 0.3];
export const RIGHT = [0.3, 0.66, 1.0];
export const MIDDLE = [0.86, 0.88, 0.92];
const SEARCHED = [0.5, 0.52, 0.56];
const LIMB_PARTS = {
  right_arm: ['right_upper_arm', 'right_lower_arm'], left_arm: ['left_upper_arm', 'left_lower_arm'],
  right_leg: ['right_upper_leg', 'right_lower_leg', 'right_foot'],
  left_leg: ['left_upper_leg', 'left_lower_leg', 'left_foot'],
};
const ENDS_OF_BODY = /head|lower_arm|foot/;  // what nothing follows: its round end must not reach beyond its length

export const colourOf = (part) => (part.startsWith('left') ? LEFT : part.startsWith('right') ? RIGHT : MIDDLE);

// Shapes of a body, each in the frame of its part: begin, reach along +Y, radii and the caps' heights at both ends.
export function shapesOf(body) {
  const has = new Set(body.parts);
  const shapes = [];
  body.parts.forEach((part, k) => {
    const reach = body.lengths[k];
    const near = body.near.slice(2 * k, 2 * k + 2);
    const far = body.far.slice(2 * k, 2 * k + 2);
    const push = (begin, end, a, b, lower, upper) =>
      shapes.push({ k, part, begin, reach: Math.max(end - begin, 0.001), near: a, far: b, caps: [lower, upper] });
    if (part === 'head' && !has.has('neck_column')) {  // the paper's head is head and neck in one cylinder
      const neck = near.map((r) => 0.58 * Math.min(...near, r));
      push(0, 0.4 * reach, neck, neck, 0.02, 0.02);
      const skull = 0.42 * reach;
      push(0.3 * reach + skull, reach - skull * 0.62, near, near.map((r) => 0.93 * r), skull, skull * 0.62);
      return;
    }
    if (part === 'head') {
      const skull = 0.42 * reach;
      push(skull, reach - skull, near, far, skull, skull);
      return;
    }
    const small = [Math.min(...near), Math.min(...far)];
    if (/torso|chest|pelvis|neck_column/.test(part)) {
      push(0, reach, near, far, 0.55 * small[0], 0.45 * small[1]);
      return;
    }
    const isEnd = ENDS_OF_BODY.test(part) || (part.endsWith('lower_leg') && !has.has(part.replace('lower_leg', 'foot')));
    const tip = isEnd ? Math.min(small[1], 0.45 * reach) : 0;
    push(0, reach - tip, near, far, small[0], isEnd ? tip : small[1]);
  });
  return shapes;
}

// The shapes in the world, with their colours.
export function placed(body, shapes, pose) {
  const person = pose.lost.includes('person');
  const searched = new Set(pose.lost.flatMap((limb) => LIMB_PARTS[limb] || []));
  return shapes.map((shape) => {
    const turn = pose.quaternions.slice(4 * shape.k, 4 * shape.k + 4);
    const start = pose.positions.slice(3 * shape.k, 3 * shape.k + 3);
    const origin = add(start, rotate(turn, [0, shape.begin, 0]));
    const lost = person || searched.has(shape.part);
    return {
      ...shape, turn, origin, end: add(origin, rotate(turn, [0, shape.reach, 0])),
      colour: [...(lost ? SEARCHED : colourOf(shape.part)), lost ? 0.45 : 1],
    };
  });
}

// A joint centre by the name it has in exports, such as "RWrist"; null when there is none.
export function centre(body, pose, name) {
  const k = body.markers.indexOf(name);
  return k < 0 ? null : pose.centres.slice(3 * k, 3 * k + 3);
}

// Where the hands and feet are: the far ends of the last parts of the limbs.
export function tips(body, pose) {
  const has = new Set(body.parts);
  return ['right', 'left'].flatMap((side) => {
    const foot = has.has(`${side}_foot`) ? `${side}_foot` : `${side}_lower_leg`;
    return [`${side}_lower_arm`, foot].map((part) => {
      const k = body.parts.indexOf(part);
      if (k < 0) return null;
      const turn = pose.quaternions.slice(4 * k, 4 * k + 4);
      const at = add(pose.positions.slice(3 * k, 3 * k + 3), rotate(turn, times([0, 1, 0], body.lengths[k])));
      return { name: part, at, colour: colourOf(part) };
    });
  }).filter(Boolean);
}
